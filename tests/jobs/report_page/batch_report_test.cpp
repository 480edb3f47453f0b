// SPDX-License-Identifier: MIT
// What a report says of a batch, from journals and reports written here.

#include "jobs/report_page/batch_report.h"

#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "engine/core/errors.h"
#include "jobs/batch/journal.h"
#include "jobs/report_page/report_page.h"
#include "tests/jobs/batch/scratch_folder.h"

namespace rattan {
namespace {

StartRecord begun(const std::string& id, double time, int attempt = 1) {
  StartRecord r;
  r.time = time;
  r.id = id;
  r.scan = "/scans/" + id;
  r.options = {"--faces", "500"};
  r.attempt = attempt;
  r.host = "here";
  return r;
}

EndRecord ended(const std::string& id, double time, int exit, double seconds, int attempt = 1) {
  EndRecord r;
  r.time = time;
  r.id = id;
  r.attempt = attempt;
  r.host = "here";
  r.exit = exit;
  r.seconds = seconds;
  r.cpu_seconds = 0.9 * seconds;
  r.peak_rss_bytes = 1000;
  if (exit == 0) {
    r.outputs = {{id, 77}};
  } else {
    r.sentence = "It failed.";
  }
  return r;
}

const ReportedScan& find(const BatchReport& report, const std::string& id) {
  for (const ReportedScan& scan : report.scans) {
    if (scan.id == id) {
      return scan;
    }
  }
  throw InternalError("no such scan");
}

TEST(BatchReport, TellsEachStatusAndReadsFiguresOfWhatIsDone) {
  const ScratchFolder folder;
  {
    JournalWriter journal(folder.path());
    for (const auto& [id, exit] : {std::pair<std::string, int>{"done.drc", 0},
                                   {"unusable.drc", 3},
                                   {"usage.drc", 2},
                                   {"full.drc", 4},
                                   {"defect.drc", 1},
                                   {"stopped.drc", 75}}) {
      journal.append(begun(id, 100.0));
      journal.append(ended(id, 110.0, exit, 10.0));
    }
    journal.append(begun("cut.drc", 100.0));
    // An attempt that failed before.
    journal.append(begun("again.drc", 90.0));
    journal.append(ended("again.drc", 95.0, 4, 5.0));
    journal.append(begun("again.drc", 100.0, 2));
    journal.append(ended("again.drc", 102.0, 0, 2.0, 2));
  }
  folder.write("report/done.drc/report.json",
               R"({"input": {"triangles": 4000, "vertices": 2002, "repaired": {"a": 3, "b": 0}},
                   "output": {"faces": 200, "quads": 190, "irregular_vertices": 7,
                              "target_met": true},
                   "singularities": {"vertices": 9, "edges": 8, "triangles": 5},
                   "distortion": {"stretch": 1.25, "shear": 0.125},
                   "distance": {"to_input_max": 0.5, "diagonal": 10.0},
                   "warnings": ["one", "two"], "options": {"ratio": 0.05}})");
  folder.write("report/done.drc/thumbnail.png");
  folder.write("report/again.drc/report.json", "{ damaged");
  folder.write("unusable.drc.log");
  const BatchReport report = read_batch_report(folder.path());
  const auto status = [&](const std::string& id) { return find(report, id).status; };
  EXPECT_EQ(status("done.drc"), ScanStatus::kDone);
  EXPECT_EQ(status("unusable.drc"), ScanStatus::kUnusable);
  EXPECT_EQ(status("usage.drc"), ScanStatus::kUnusable);
  EXPECT_EQ(status("full.drc"), ScanStatus::kResource);
  EXPECT_EQ(status("defect.drc"), ScanStatus::kDefect);
  EXPECT_EQ(status("stopped.drc"), ScanStatus::kInterrupted);
  EXPECT_EQ(status("cut.drc"), ScanStatus::kInterrupted);
  EXPECT_FALSE(find(report, "cut.drc").sentence.empty());
  EXPECT_EQ(status("again.drc"), ScanStatus::kDone);
  EXPECT_EQ(find(report, "again.drc").attempts, 2);
  EXPECT_FALSE(find(report, "again.drc").has_report);
  EXPECT_TRUE(find(report, "unusable.drc").has_log);

  const ReportedScan& done = find(report, "done.drc");
  EXPECT_EQ(done.figures.triangles, 4000U);
  EXPECT_EQ(done.figures.singularities, 5U);
  EXPECT_EQ(done.figures.stretch, 1.25);
  EXPECT_EQ(done.figures.target_met, true);
  EXPECT_FALSE(done.figures.to_input_rms);
  EXPECT_EQ(done.figures.repairs, (std::vector<std::pair<std::string, std::uint64_t>>{{"a", 3}}));
  EXPECT_EQ(done.figures.warnings.size(), 2U);
  EXPECT_EQ(done.thumbnails, std::vector<std::string>{"thumbnail.png"});
  EXPECT_TRUE(done.viewers.empty());  // there is no such file
  EXPECT_EQ(done.triangles_per_second(), 400.0);
  EXPECT_EQ(done.output_bytes, 77U);
  EXPECT_EQ(done.options, "--faces 500");

  const ReportTotals& t = report.totals;
  EXPECT_EQ(t.scans, 8U);
  EXPECT_EQ(t.with(ScanStatus::kDone), 2U);
  EXPECT_EQ(t.with(ScanStatus::kUnusable), 2U);
  EXPECT_EQ(t.triangles, 4000U);
  EXPECT_EQ(t.output_bytes, 154U);
  EXPECT_NEAR(t.scan_seconds, 6 * 10.0 + 5.0 + 2.0, 1e-5);
  EXPECT_NEAR(t.cpu_seconds, 0.9 * t.scan_seconds, 1e-5);
  EXPECT_EQ(t.warnings, 2U);
  EXPECT_EQ(t.repairs, 3U);
}

TEST(BatchReport, FindsThePicturesOfSeveralSizes) {
  const ScratchFolder folder;
  {
    JournalWriter journal(folder.path());
    journal.append(begun("{n}.drc", 100.0));
    journal.append(ended("{n}.drc", 110.0, 0, 10.0));
  }
  folder.write("report/{n}.drc/report.json", R"({"options": {"faces": [500, 20000]}})");
  for (const char* name :
       {"thumbnail-500.png", "thumbnail-20000.png", "view-500.js", "view-20000.js"}) {
    folder.write(std::string("report/{n}.drc/") + name);
  }
  const BatchReport report = read_batch_report(folder.path());
  ASSERT_EQ(report.scans.size(), 1U);
  EXPECT_EQ(report.scans[0].thumbnails.size(), 2U);
  EXPECT_EQ(report.scans[0].viewers.size(), 2U);
}

TEST(BatchReport, CountsWhatHasNotBegun) {
  const ScratchFolder folder;
  {
    JournalWriter journal(folder.path());
    BatchRecord batch;
    batch.action = "begin";
    batch.items = batch.total = 10;
    journal.append(batch);
    journal.append(begun("a.drc", 100.0));
    journal.append(ended("a.drc", 110.0, 0, 10.0));
  }
  EXPECT_EQ(read_batch_report(folder.path()).totals.with(ScanStatus::kPending), 9U);
  const auto what = std::make_shared<ItemOptions>();
  std::vector<BatchItem> items(2);
  items[0].id = "a.drc";
  items[1].id = "b.drc";
  items[0].what = items[1].what = what;
  const BatchReport report = read_batch_report(folder.path(), items);
  EXPECT_EQ(report.totals.scans, 2U);
  EXPECT_EQ(find(report, "b.drc").status, ScanStatus::kPending);
  EXPECT_THROW(read_batch_report(folder / "nowhere"), InputError);
}

TEST(Throughput, AddsUpToAllTrianglesAndLeavesIdleTimeOut) {
  BatchReport report;
  const auto scan = [&](double begin, double end, std::uint64_t triangles) {
    ReportedScan s;
    s.id = std::to_string(report.scans.size());
    s.status = ScanStatus::kDone;
    s.started = begin;
    s.ended = end;
    s.seconds = end - begin;
    s.figures.triangles = triangles;
    report.scans.push_back(s);
  };
  for (int i = 0; i < 200; ++i) {
    scan(1000.0 + 3.7 * i, 1000.0 + 3.7 * i + 11.3, 1000 + static_cast<std::uint64_t>(i));
    scan(90000.0 + 2.1 * i, 90000.0 + 2.1 * i + 0.7, 500);
  }
  sum_up(report, 0.0, 0.0);
  double triangles = 0.0;
  double seconds = 0.0;
  std::uint64_t scans = 0;
  for (const ThroughputStep& step : report.throughput) {
    triangles += step.triangles_per_second * step.seconds;
    seconds += step.seconds;
    scans += step.scans;
    EXPECT_TRUE(step.time < 2000.0 || step.time >= 90000.0);
  }
  EXPECT_NEAR(triangles, static_cast<double>(report.totals.triangles), 1e-3);
  EXPECT_EQ(scans, 400U);
  EXPECT_LT(seconds, 1300.0);
  EXPECT_GT(report.throughput.size(), 40U);
  EXPECT_LT(report.throughput.size(), 180U);
  EXPECT_LT(report.totals.wall_seconds, seconds);
}

TEST(WriteBatchReport, LeavesBothFiles) {
  const ScratchFolder folder;
  {
    JournalWriter journal(folder.path());
    journal.append(begun("a.drc", 100.0));
    journal.append(ended("a.drc", 110.0, 3, 10.0));
  }
  EXPECT_EQ(write_batch_report(folder.path()).scans, 1U);
  std::ifstream json(folder / "report.json");
  EXPECT_EQ(nlohmann::json::parse(json)["totals"]["unusable"], 1);
  EXPECT_GT(std::filesystem::file_size(folder / "report.html"), 20'000U);
}

}  // namespace
}  // namespace rattan
