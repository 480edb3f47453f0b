// SPDX-License-Identifier: MIT
#include "jobs/batch/batch_run.h"

#include <chrono>
#include <csignal>
#include <filesystem>
#include <map>
#include <sys/stat.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "engine/core/errors.h"
#include "engine/core/resident_memory.h"
#include "jobs/batch/batch_status.h"
#include "jobs/batch/claims.h"
#include "jobs/batch/item_states.h"
#include "tests/jobs/batch/batch_fixture.h"

namespace rattan {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

// Stands for the program: does what the scan's first line says, and counts its runs in a file
// beside the scan.
constexpr const char* kProgram = R"sh(#!/bin/bash
scan=$2; shift 2
while [ $# -gt 0 ]; do
  case $1 in
    -o) out=$2; shift;;
    --report) report=$2; shift;;
    --memory) memory=$2; shift;;
    --threads) threads=$2; shift;;
    --faces) faces=$2; shift;;
    --thumbnail|--viewer|--log-format) shift;;
  esac
  shift
done
echo "$threads $memory" >> "$scan.runs"
read -r what argument < "$scan"
finish() {
  printf '%s %s' "$(cat "$scan")" "$faces" > "$out"
  bytes=$(stat -c %s "$out")
  printf '{"input":{"path":"%s"},"outputs":[{"bytes":%d}],"seconds":1.5,"peak_rss_bytes":7,' \
    "$scan" "$bytes" > "$report"
  echo '"warnings":[]}' >> "$report"
}
fail() {
  echo "{\"event\":\"error\",\"text\":\"$scan: $2\",\"exit\":$1}" >&2
  exit $1
}
case $what in
  ok) finish;;
  slow) sleep "$argument"; finish;;
  bad) fail 3 "it is bad";;
  full) fail 4 "the disk is full";;
  weird) echo "terminate called" >&2; exit 9;;
  kill) kill -KILL $$;;
  segv) echo "last words" >&2; kill -SEGV $$;;
  lies) exit 0;;
  least) [ "$memory" -ge "$argument" ] || fail 4 "too small. Allow --memory more"; finish;;
  wait) trap 'echo saved > "$scan.saved"; exit 75' TERM; while :; do sleep 0.02; done;;
  orphan) trap '' TERM; echo up > "$scan.up"; sleep 0.7; finish;;
  deaf) trap '' TERM; while :; do sleep 0.05; done;;
esac
)sh";

class Recorder final : public BatchObserver {
 public:
  void started(const BatchItem& item, const Attempt& attempt) override {
    starts.push_back(item.id);
    threads[item.id] = attempt.threads;
  }
  void ended(const BatchItem& item, const Attempt& attempt) override { ends[item.id] = attempt; }
  void finished(const BatchState& last, int) override { state = last; }

  std::vector<std::string> starts;
  std::map<std::string, Attempt> ends;
  std::map<std::string, int> threads;
  BatchState state;
};

class BatchRunTest : public BatchFixture {
 protected:
  BatchRunTest() {
    options_.directory = path("out");
    options_.program = write("program", kProgram);
    ::chmod(options_.program.c_str(), 0755);
    options_.threads = 2;
    options_.memory = std::uint64_t{4} << 30;
    options_.observers = {&seen_};
  }
  void add(const std::string& name, const std::string& what) {
    write("scans/" + name, what + "\n");
    names_.push_back(name);
  }
  std::vector<BatchItem> items(const RemeshOptions& options = {}) const {
    std::vector<BatchItem> list;
    for (const std::string& name : names_) {
      BatchItem i = item("sub/" + name + ".drc", path("scans/" + name), options);
      if (options.size_kind == SizeKind::kFaces) {
        auto what = std::make_shared<ItemOptions>(*i.what);
        what->words = {"--faces", fmt::format("{:.0f}", options.sizes[0])};
        i.what = what;
      }
      list.push_back(i);
    }
    return list;
  }
  int run() { return run(items()); }
  int run(const std::vector<BatchItem>& list) {
    seen_ = {};
    return run_batch(list, options_);
  }
  std::size_t runs_of(const std::string& name) const {
    const std::string text = read(path("scans/" + name + ".runs"));
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  }
  std::string output(const std::string& name) const {
    return read(path("out/sub/" + name + ".drc"));
  }
  const Attempt& end_of(const std::string& name) const {
    return seen_.ends.at("sub/" + name + ".drc");
  }
  template <class Condition>
  static bool wait_for(const Condition& condition) {
    for (int i = 0; i < 2000; ++i) {
      if (condition()) {
        return true;
      }
      std::this_thread::sleep_for(5ms);
    }
    return false;
  }
  /// run_batch in a process of its own.
  pid_t fork_run() {
    const pid_t pid = ::fork();
    if (pid == 0) {
      int exit = 99;
      try {
        exit = run_batch(items(), options_);
      } catch (const std::exception& e) {
        std::fprintf(stderr, "%s\n", e.what());
      }
      ::_exit(exit);
    }
    return pid;
  }
  static int exit_of(pid_t pid) {
    int status = 0;
    ::waitpid(pid, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

  BatchRunOptions options_;
  Recorder seen_;
  std::vector<std::string> names_;
};

TEST_F(BatchRunTest, MakesAllAndThenNothing) {
  for (int i = 0; i < 12; ++i) {
    add(fmt::format("s{}", i), fmt::format("ok {}", i));
  }
  EXPECT_EQ(run(), 0);
  EXPECT_EQ(seen_.starts.size(), 12U);
  EXPECT_EQ(output("s7"), "ok 7 ");
  EXPECT_EQ(seen_.state.done, 12U);
  EXPECT_EQ(run(), 0);
  EXPECT_TRUE(seen_.starts.empty());
  EXPECT_EQ(seen_.state.before, 12U);
  // Claims leave nothing.
  EXPECT_TRUE(fs::is_empty(path("out/.rattan/claims")));
  EXPECT_FALSE(fs::exists(path("out/sub/s7.drc.log")));
}

TEST_F(BatchRunTest, OneFailureStopsNothing) {
  add("a", "ok 1");
  add("b", "bad");
  add("c", "full");
  add("d", "segv");
  add("e", "kill");
  add("f", "weird");
  add("g", "lies");
  add("h", "ok 2");
  EXPECT_EQ(run(), 1);
  EXPECT_EQ(seen_.state.done, 2U);
  EXPECT_EQ(end_of("b").exit, 3);
  EXPECT_EQ(end_of("b").sentence, path("scans/b") + ": it is bad");
  EXPECT_EQ(end_of("c").exit, 4);
  EXPECT_EQ(end_of("d").exit, 1);
  EXPECT_EQ(end_of("d").signal, SIGSEGV);
  EXPECT_NE(end_of("d").sentence.find("last words"), std::string::npos);
  EXPECT_EQ(end_of("e").exit, 4);
  EXPECT_NE(end_of("e").sentence.find("want of memory"), std::string::npos);
  EXPECT_EQ(end_of("f").exit, 1);
  EXPECT_EQ(end_of("f").sentence, "terminate called");
  EXPECT_EQ(end_of("g").exit, 1);
  const std::string log = read(path("out/sub/d.drc.log"));
  EXPECT_NE(log.find("last words"), std::string::npos);
  EXPECT_NE(log.find(" remesh " + path("scans/d")), std::string::npos);
  EXPECT_FALSE(fs::exists(path("out/sub/a.drc.log")));
}

TEST_F(BatchRunTest, ExitCodeIsThatOfTheWorst) {
  add("a", "ok");
  EXPECT_EQ(run(), 0);
  add("b", "bad");
  EXPECT_EQ(run(), 3);
  add("c", "full");
  EXPECT_EQ(run(), 4);
  EXPECT_EQ(runs_of("b"), 1U);
  EXPECT_EQ(run(), 4) << "of a scan that failed for want of a resource, again";
  EXPECT_EQ(runs_of("c"), 2U);
}

TEST_F(BatchRunTest, TriesAgainWhatChangedOrIsAskedFor) {
  add("a", "ok 1");
  add("b", "bad");
  add("c", "weird");
  EXPECT_EQ(run(), 1);
  EXPECT_EQ(run(), 1);
  EXPECT_EQ(runs_of("a") + runs_of("b") + runs_of("c"), 3U);
  EXPECT_EQ(plan_batch(items(), options_)[1], Standing::kFailed);
  options_.retry_failed = true;
  EXPECT_EQ(run(), 1);
  EXPECT_EQ(runs_of("b"), 2U);
  EXPECT_EQ(end_of("b").number, 2);
  EXPECT_EQ(runs_of("c"), 2U);
  EXPECT_EQ(runs_of("a"), 1U);
  options_.retry_failed = false;
  add("b", "ok now");  // the scan is mended
  names_.pop_back();
  EXPECT_EQ(plan_batch(items(), options_)[1], Standing::kScanChanged);
  EXPECT_EQ(run(), 1);
  EXPECT_EQ(output("b"), "ok now ");
  EXPECT_FALSE(fs::exists(path("out/sub/b.drc.log")));
  fs::remove(path("out/sub/a.drc"));
  EXPECT_EQ(plan_batch(items(), options_)[0], Standing::kOutputMissing);
  run();
  EXPECT_EQ(runs_of("a"), 2U);
  write("out/sub/a.drc", "something else");
  run();
  EXPECT_EQ(output("a"), "ok 1 ");
  options_.fresh = true;
  run();
  EXPECT_EQ(runs_of("a"), 4U);
}

TEST_F(BatchRunTest, ChangedOptionsRedoWhatTheyAffect) {
  add("a", "ok");
  add("b", "ok");
  RemeshOptions faces;
  faces.size_kind = SizeKind::kFaces;
  faces.sizes = {100};
  EXPECT_EQ(run(items(faces)), 0);
  std::vector<BatchItem> mixed = items(faces);
  faces.sizes = {200};
  mixed[1] = items(faces)[1];
  EXPECT_EQ(plan_batch(mixed, options_),
            (std::vector<Standing>{Standing::kDone, Standing::kOptionsChanged}));
  EXPECT_EQ(run(mixed), 0);
  EXPECT_EQ(seen_.starts, (std::vector<std::string>{"sub/b.drc"}));
  EXPECT_EQ(output("b"), "ok 200");
  EXPECT_EQ(output("a"), "ok 100");
}

TEST_F(BatchRunTest, AWrongForecastOfMemoryIsMadeGood) {
  add("a", fmt::format("least {}", std::uint64_t{3} << 30));
  add("b", "ok");
  add("c", "ok");
  EXPECT_EQ(run(), 0);
  EXPECT_EQ(runs_of("a"), 2U);
  EXPECT_EQ(end_of("a").number, 2);
  EXPECT_EQ(run(), 0);
  EXPECT_EQ(runs_of("a"), 2U);
}

TEST_F(BatchRunTest, RefusesWhatNeedsMoreThanThereIs) {
  add("a", "ok");
  names_.clear();
  // A header that counts.
  write("scans/big", "OFF\n40000 80000 0\n" + std::string(1 << 20, '#'));
  RemeshOptions faces;
  faces.size_kind = SizeKind::kFaces;
  faces.sizes = {5e6};
  std::vector<BatchItem> list = {item("big.drc", path("scans/big"), faces),
                                 item("a.drc", path("scans/a"))};
  EXPECT_EQ(run(list), 4);
  EXPECT_EQ(seen_.starts, (std::vector<std::string>{"a.drc"}));
  EXPECT_EQ(seen_.ends.at("big.drc").exit, 4);
  EXPECT_NE(seen_.ends.at("big.drc").sentence.find("Allow --memory "), std::string::npos);
  EXPECT_TRUE(fs::exists(path("out/big.drc.log")));
}

TEST_F(BatchRunTest, StopsWithTheWorkSaved) {
  add("a", "wait");
  add("b", "wait");
  add("c", "ok");
  add("d", "ok");
  for (const int signal : {SIGTERM, SIGINT, SIGUSR1}) {
    const pid_t pid = fork_run();
    const std::size_t before = runs_of("a") + runs_of("b");
    ASSERT_TRUE(wait_for([&] { return runs_of("a") + runs_of("b") >= 2 + before; }) ||
                runs_of("a") + runs_of("b") > 0);
    std::this_thread::sleep_for(100ms);
    const auto start = std::chrono::steady_clock::now();
    ::kill(pid, signal);
    EXPECT_EQ(exit_of(pid), 75);
    EXPECT_LT(std::chrono::steady_clock::now() - start, 5s);
    EXPECT_EQ(read(path("scans/a.saved")), "saved\n");
    fs::remove(path("scans/a.saved"));
  }
  EXPECT_EQ(plan_batch(items(), options_)[0], Standing::kUnfinished);
}

TEST_F(BatchRunTest, AChildThatDoesNotStopIsKilledInTime) {
  add("a", "deaf");
  const pid_t pid = fork_run();
  ASSERT_TRUE(wait_for([&] { return runs_of("a") == 1; }));
  std::this_thread::sleep_for(100ms);
  const auto start = std::chrono::steady_clock::now();
  ::kill(pid, SIGTERM);
  ::kill(pid, SIGTERM);  // one request, as Slurm makes it
  std::this_thread::sleep_for(2500ms);
  ::kill(pid, SIGTERM);  // at once now
  EXPECT_EQ(exit_of(pid), 75);
  const auto taken = std::chrono::steady_clock::now() - start;
  EXPECT_GT(taken, 2400ms);
  EXPECT_LT(taken, 5s);
  EXPECT_EQ(plan_batch(items(), options_)[0], Standing::kUnfinished);
}

TEST_F(BatchRunTest, WhatAChildFinishedAfterItsBatchDiedIsNotMadeAgain) {
  add("a", "orphan");
  const pid_t pid = fork_run();
  ASSERT_TRUE(wait_for([&] { return fs::exists(path("scans/a.up")); }));
  ::kill(pid, SIGKILL);
  exit_of(pid);
  ASSERT_TRUE(wait_for([&] { return fs::exists(path("out/report/sub/a.drc/report.json")); }));
  std::this_thread::sleep_for(100ms);
  EXPECT_EQ(run(), 0);
  EXPECT_EQ(runs_of("a"), 1U);
  EXPECT_TRUE(end_of("a").adopted);
  EXPECT_EQ(end_of("a").seconds, 1.5);
  EXPECT_EQ(end_of("a").number, 1);
  EXPECT_EQ(run(), 0);
  EXPECT_TRUE(seen_.ends.empty());
}

TEST_F(BatchRunTest, AnOldReportProvesNothing) {
  add("a", "ok");
  EXPECT_EQ(run(), 0);
  add("a", "kill");  // changed: the report of the old scan must not stand for it
  names_.pop_back();
  EXPECT_EQ(run(), 4);
  EXPECT_EQ(run(), 4);
  EXPECT_EQ(runs_of("a"), 3U);
}

TEST_F(BatchRunTest, TwoBatchesShareTheWork) {
  for (int i = 0; i < 30; ++i) {
    add(fmt::format("s{}", i), i % 7 == 3 ? "bad" : fmt::format("slow 0.0{}", i % 10));
  }
  const pid_t one = fork_run();
  const pid_t two = fork_run();
  EXPECT_EQ(exit_of(one), 3);
  EXPECT_EQ(exit_of(two), 3);
  for (const std::string& name : names_) {
    EXPECT_EQ(runs_of(name), 1U) << name;
  }
}

TEST_F(BatchRunTest, WaitsForWhatAnotherHasAndTakesItOver) {
  add("a", "ok");
  auto claim = Claim::take(options_.directory, "sub/a.drc");
  ASSERT_NE(claim, nullptr);
  EXPECT_EQ(Claim::take(options_.directory, "sub/a.drc"), nullptr);
  const pid_t pid = fork_run();
  std::this_thread::sleep_for(700ms);
  EXPECT_EQ(runs_of("a"), 0U);
  const BatchStatus status = read_batch_status(options_.directory);
  EXPECT_EQ(status.pending, 1U);
  claim.reset();
  EXPECT_EQ(exit_of(pid), 0);
  EXPECT_EQ(runs_of("a"), 1U);
}

TEST_F(BatchRunTest, ClaimsOfTheDeadAreTakenOverAtOnce) {
  add("a", "wait");
  const pid_t pid = fork_run();
  ASSERT_TRUE(wait_for([&] { return runs_of("a") == 1; }));
  EXPECT_TRUE(Claim::holder(options_.directory, "sub/a.drc"));
  const BatchStatus during = read_batch_status(options_.directory);
  ASSERT_EQ(during.running.size(), 1U);
  EXPECT_EQ(during.running[0].pid, pid);
  EXPECT_EQ(during.processes, 1U);
  ::kill(pid, SIGKILL);
  exit_of(pid);
  EXPECT_FALSE(Claim::holder(options_.directory, "sub/a.drc"));
  const BatchStatus after = read_batch_status(options_.directory);
  EXPECT_TRUE(after.running.empty());
  EXPECT_EQ(after.interrupted, 1U);
  EXPECT_EQ(after.processes, 0U);
  write("scans/a", "ok again\n");
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(run(), 0);
  EXPECT_LT(std::chrono::steady_clock::now() - start, 3s);
}

TEST_F(BatchRunTest, StatusCountsEverything) {
  EXPECT_THROW(read_batch_status(path("out")), InputError);
  add("a", "ok");
  add("b", "bad");
  add("c", "weird");
  options_.total = 10;
  run();
  const BatchStatus status = read_batch_status(options_.directory);
  EXPECT_EQ(status.items, 10U);
  EXPECT_EQ(status.done, 1U);
  EXPECT_EQ(status.pending, 7U);
  ASSERT_EQ(status.failures.size(), 2U);
  EXPECT_EQ(status.failures[0].id, "sub/c.drc");
  EXPECT_EQ(status.failures[1].sentence, path("scans/b") + ": it is bad");
  EXPECT_EQ(to_json(status).at("failed"), 2);
  EXPECT_NE(describe(status).find("1 done, 2 failed"), std::string::npos);
}

TEST_F(BatchRunTest, AHundredThousandItemsFitIntoLittleMemory) {
  constexpr int kItems = 100000;
  write("scans/a", "ok\n");
  const auto what = item("x", path("scans/a")).what;
  const std::uint64_t before = resident_bytes();
  std::vector<BatchItem> list(kItems);
  const FileStamp stamp = FileStamp::of(path("scans/a"));
  for (int i = 0; i < kItems; ++i) {
    list[static_cast<std::size_t>(i)] = {fmt::format("some/folder/of/scans/scan-{:06}.drc", i),
                                         path("scans/a"), what, stamp.bytes, stamp.time};
  }
  // All but one are done.
  fs::create_directories(path("out/.rattan/journal"));
  const std::string outputs = path("out/some/folder/of/scans/");
  fs::create_directories(outputs);
  {
    std::ofstream journal(path("out/.rattan/journal/x-1-1.jsonl"));
    for (int i = 1; i < kItems; ++i) {
      const std::string& id = list[static_cast<std::size_t>(i)].id;
      journal << nlohmann::json{{"event", "start"},
                                {"time", 1.0},
                                {"id", id},
                                {"attempt", 1},
                                {"scan", path("scans/a")},
                                {"scan_bytes", stamp.bytes},
                                {"scan_time", stamp.time},
                                {"key", what->key},
                                {"rattan", rattan_identity()},
                                {"options", {"--faces", "5"}}}
              << "\n";
      journal << nlohmann::json{{"event", "end"}, {"time", 2.0},
                                {"id", id},       {"attempt", 1},
                                {"exit", 3},      {"outputs", nlohmann::json::array()}}
              << "\n";
    }
  }
  const std::clock_t start = std::clock();
  EXPECT_EQ(run(list), 3);
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  EXPECT_EQ(seen_.starts, (std::vector<std::string>{list[0].id}));
  const std::uint64_t after = resident_bytes();
  std::printf("%.1f MiB and %.2f s for %d items\n", static_cast<double>(after - before) / (1 << 20),
              seconds, kItems);
  EXPECT_LT(after - before, std::uint64_t{48} << 20);
}

}  // namespace
}  // namespace rattan
