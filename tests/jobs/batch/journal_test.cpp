// SPDX-License-Identifier: MIT
#include "jobs/batch/journal.h"

#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include <fmt/format.h>

#include "tests/jobs/batch/batch_fixture.h"

namespace rattan {
namespace {

StartRecord start_of(const std::string& id, int attempt) {
  StartRecord r;
  r.time = 1000.0 + attempt;
  r.id = id;
  r.scan = "/scans/" + id;
  r.scan_bytes = 12345678901234ULL;
  r.scan_time = 1763824800123456789LL;
  r.key = "faces=5000 density=1";
  r.options = {"--faces", "5000", "--crease", "off"};
  r.attempt = attempt;
  r.host = "node \"7\"";
  r.pid = 77;
  r.slurm = "12_3";
  r.threads = 4;
  r.memory = 1U << 30U;
  r.cost = 1.25;
  r.triangles = 1e6;
  r.rattan = "0.1.0 abc";
  return r;
}

EndRecord end_of(const std::string& id, int attempt, int exit) {
  EndRecord r;
  r.time = 1010.0 + attempt;
  r.id = id;
  r.attempt = attempt;
  r.host = "node";
  r.pid = 77;
  r.exit = exit;
  r.sentence = exit == 0 ? "" : "line 3:\tbad\n\"number\"";
  r.seconds = 2.5;
  r.cpu_seconds = 3.5;
  r.peak_rss_bytes = 99999999;
  if (exit == 0) {
    r.outputs = {{id, 4000}, {id + "2", 123}};
  }
  r.warnings = 2;
  return r;
}

class JournalTest : public BatchFixture {
 protected:
  std::string only_file() const {
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / ".rattan/journal")) {
      return entry.path().string();
    }
    return "";
  }
};

TEST_F(JournalTest, WhatIsWrittenIsRead) {
  JournalWriter writer(folder_);
  writer.append(start_of("a/b.drc", 1));
  writer.append(end_of("a/b.drc", 1, 3));
  writer.append(start_of("a/b.drc", 2));
  writer.append(end_of("a/b.drc", 2, 0));
  BatchRecord batch;
  batch.action = "begin";
  batch.total = 7;
  batch.shard = 2;
  batch.shards = 3;
  writer.append(batch);
  Journal journal(folder_);
  EXPECT_TRUE(journal.refresh());
  ASSERT_EQ(journal.scans().size(), 1U);
  const ScanHistory* h = journal.find("a/b.drc");
  ASSERT_NE(h, nullptr);
  EXPECT_EQ(h->scan, "/scans/a/b.drc");
  EXPECT_EQ(h->scan_bytes, 12345678901234ULL);
  EXPECT_EQ(h->scan_time, 1763824800123456789LL);
  EXPECT_EQ(h->key, "faces=5000 density=1");
  EXPECT_EQ(h->options, "--faces 5000 --crease off");
  EXPECT_EQ(h->host, "node \"7\"");
  EXPECT_EQ(h->slurm, "12_3");
  EXPECT_EQ(h->attempts, 2);
  EXPECT_EQ(h->exit, 0);
  EXPECT_FALSE(h->open());
  EXPECT_EQ(h->seconds, 2.5);
  EXPECT_EQ(h->peak_rss_bytes, 99999999U);
  EXPECT_EQ(h->warnings, 2U);
  const auto outputs = journal.outputs(*h);
  ASSERT_EQ(outputs.size(), 2U);
  EXPECT_EQ(outputs[0].path, "a/b.drc");
  EXPECT_EQ(outputs[1].bytes, 123U);
  EXPECT_EQ(journal.finishes().size(), 2U);
  ASSERT_EQ(journal.batches().size(), 1U);
  EXPECT_EQ(journal.batches()[0].total, 7U);
  EXPECT_EQ(journal.batches()[0].shards, 3U);
  EXPECT_FALSE(journal.refresh());
}

TEST_F(JournalTest, KeepsSentencesAndNamesOfAnyBytes) {
  const std::string odd = "caf\xe9 \xf0\x9f\x90\xa8 \"x\"\n.drc";
  const std::string other = "caf\xea \xf0\x9f\x90\xa8 \"x\"\n.drc";
  JournalWriter writer(folder_);
  for (const std::string& id : {odd, other}) {
    writer.append(start_of(id, 1));
    writer.append(end_of(id, 1, id == odd ? 0 : 3));
  }
  Journal journal(folder_);
  journal.refresh();
  ASSERT_NE(journal.find(odd), nullptr);
  ASSERT_NE(journal.find(other), nullptr);
  EXPECT_EQ(journal.find(odd)->exit, 0);
  EXPECT_EQ(journal.outputs(*journal.find(odd))[0].path, odd);
  EXPECT_EQ(journal.find(odd)->scan, "/scans/" + odd);
  EXPECT_EQ(journal.find(other)->sentence, "line 3:\tbad\n\"number\"");
}

TEST_F(JournalTest, EveryPrefixOfAFileIsReadAsFarAsItsWholeLines) {
  {
    JournalWriter writer(folder_);
    for (int i = 1; i <= 3; ++i) {
      writer.append(start_of("x.drc", i));
      writer.append(end_of("x.drc", i, i == 3 ? 0 : 75));
    }
  }
  const std::string file = only_file();
  const std::string all = read(file);
  for (std::size_t n = 0; n <= all.size(); n += 7) {
    std::ofstream(file, std::ios::binary | std::ios::trunc) << all.substr(0, n);
    Journal journal(folder_);
    journal.refresh();
    const auto lines = static_cast<std::uint64_t>(
        std::count(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(n), '\n'));
    EXPECT_EQ(journal.records(), lines);
    // The rest comes later.
    std::ofstream(file, std::ios::binary | std::ios::app) << all.substr(n);
    journal.refresh();
    EXPECT_EQ(journal.records(), 6U) << n;
    EXPECT_EQ(journal.find("x.drc")->exit, 0);
  }
}

TEST_F(JournalTest, PassesOverWhatIsNoRecord) {
  {
    JournalWriter writer(folder_);
    writer.append(start_of("x.drc", 1));
  }
  const std::string file = only_file();
  const std::string good = read(file);
  std::ofstream(file, std::ios::binary | std::ios::trunc)
      << good.substr(0, 40) << "\n"
      << std::string(100, '\0') << "\nnull\n[1,2]\n{}\n"
      << "{\"event\":\"start\",\"id\":7}\n{\"event\":\"end\",\"outputs\":[[[[[[[[[[[]]]]]]]]]]]}\n"
      << "{\"event\":\"end\",\"id\":\"x.drc\",\"attempt\":1e300,\"outputs\":{\"path\":3}}\n\n"
      << good;
  Journal journal(folder_);
  journal.refresh();
  ASSERT_NE(journal.find("x.drc"), nullptr);
  EXPECT_EQ(journal.find("x.drc")->key, "faces=5000 density=1");
}

TEST_F(JournalTest, NumbersOfAttemptsOrderWhatClocksDoNot) {
  JournalWriter early(folder_);
  JournalWriter late(folder_);
  StartRecord second = start_of("x.drc", 2);
  second.time = 10.0;  // by a clock that is behind
  EndRecord second_end = end_of("x.drc", 2, 0);
  second_end.time = 11.0;
  early.append(second);
  early.append(second_end);
  late.append(start_of("x.drc", 1));
  late.append(end_of("x.drc", 1, 3));
  Journal journal(folder_);
  journal.refresh();
  EXPECT_EQ(journal.find("x.drc")->attempts, 2);
  EXPECT_EQ(journal.find("x.drc")->exit, 0);
}

TEST_F(JournalTest, ManyWritersAtOnceLoseNothing) {
  constexpr int kWriters = 8;
  constexpr int kEach = 40;
  std::vector<std::thread> threads;
  for (int w = 0; w < kWriters; ++w) {
    threads.emplace_back([&, w] {
      JournalWriter writer(folder_);
      for (int i = 0; i < kEach; ++i) {
        writer.append(start_of(fmt::format("{}-{}.drc", w, i), 1));
        writer.append(end_of(fmt::format("{}-{}.drc", w, i), 1, 0));
      }
    });
  }
  Journal journal(folder_);
  for (int i = 0; i < 20; ++i) {
    journal.refresh();
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
  journal.refresh();
  EXPECT_EQ(journal.records(), 2U * kWriters * kEach);
  EXPECT_EQ(journal.scans().size(), std::size_t{kWriters} * kEach);
  for (const ScanHistory& scan : journal.scans()) {
    EXPECT_EQ(scan.exit, 0);
  }
}

TEST_F(JournalTest, AHundredThousandRecordsAreReadPromptly) {
  std::string lines;
  {
    JournalWriter writer(folder_);
    writer.append(start_of("scan-000000.drc", 1));
    writer.append(end_of("scan-000000.drc", 1, 0));
  }
  const std::string file = only_file();
  const std::string pair = read(file);
  constexpr int kPairs = 50000;
  for (int i = 1; i < kPairs; ++i) {
    std::string text = pair;
    const std::string id = fmt::format("scan-{:06}", i);
    for (std::size_t at = text.find("scan-000000"); at != std::string::npos;
         at = text.find("scan-000000", at)) {
      text.replace(at, id.size(), id);
    }
    lines += text;
  }
  std::ofstream(file, std::ios::binary | std::ios::app) << lines;
  // Processor time of this thread: the machine may be busy.
  const std::clock_t before = std::clock();
  Journal journal(folder_);
  journal.refresh();
  const double seconds = static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
  EXPECT_EQ(journal.records(), 2U * kPairs);
  RecordProperty("seconds", fmt::format("{:.3f}", seconds));
  std::printf("%d records of %.0f MB in %.2f s\n", 2 * kPairs,
              1e-6 * static_cast<double>(lines.size()), seconds);
  EXPECT_LT(seconds, 3.0);  // under a second; sanitizers take more
}

}  // namespace
}  // namespace rattan
