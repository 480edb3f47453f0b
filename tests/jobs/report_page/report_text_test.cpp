// SPDX-License-Identifier: MIT
// The texts of a report, whatever the names of files.

#include "jobs/report_page/report_text.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "jobs/report_page/page_assets.h"

namespace rattan {
namespace {

using Json = nlohmann::json;

std::string html_of(const BatchReport& report) {
  std::string text;
  write_report_html(report, [&](std::string_view piece) { text += piece; });
  return text;
}

std::string json_of(const BatchReport& report) {
  std::string text;
  write_report_json(report, [&](std::string_view piece) { text += piece; });
  return text;
}

/// What the page's script gets.
Json data_of(const std::string& html) {
  const std::string begin = "<script type=\"application/json\" id=\"data\">";
  const std::size_t from = html.find(begin) + begin.size();
  return Json::parse(html.substr(from, html.find("</script>", from) - from));
}

ReportedScan done_scan(const std::string& id) {
  ReportedScan scan;
  scan.id = id;
  scan.scan = "/scans/" + id + ".ply";
  scan.status = ScanStatus::kDone;
  scan.exit = 0;
  scan.attempts = 1;
  scan.started = 1000.0;
  scan.ended = 1004.0;
  scan.seconds = 4.0;
  scan.outputs = {id};
  scan.figures.triangles = 1000;
  scan.figures.faces = 50;
  scan.figures.quads = 48;
  scan.has_report = true;
  scan.thumbnails = {"thumbnail.png"};
  scan.viewers = {"view.js"};
  return scan;
}

TEST(LinkTo, EncodesAllBytesThatMeanSomethingInAddresses) {
  EXPECT_EQ(link_to("a/b-1_2.c~"), "a/b-1_2.c~");
  EXPECT_EQ(link_to("a b%#?\"<&"), "a%20b%25%23%3F%22%3C%26");
  EXPECT_EQ(link_to("\xc3\xbc\xff\n"), "%C3%BC%FF%0A");
}

TEST(ReportJson, HoldsEveryFigureByItsName) {
  BatchReport report;
  report.directory = "/out";
  report.created = 0.0;
  report.scans = {done_scan("statues/koala.drc")};
  ReportedScan failed;
  failed.id = "bad.drc";
  failed.status = ScanStatus::kUnusable;
  failed.exit = 3;
  failed.sentence = "It is empty.";
  failed.has_log = true;
  report.scans.push_back(failed);
  sum_up(report, 3.5, 4.25);
  const Json j = Json::parse(json_of(report));
  EXPECT_EQ(j["created"], "1970-01-01T00:00:00Z");
  EXPECT_EQ(j["totals"]["scans"], 2);
  EXPECT_EQ(j["totals"]["done"], 1);
  EXPECT_EQ(j["totals"]["unusable"], 1);
  EXPECT_EQ(j["totals"]["triangles"], 1000);
  EXPECT_EQ(j["totals"]["cpu_seconds"], 3.5);
  EXPECT_EQ(j["totals"]["wall_seconds"], 4.0);
  EXPECT_EQ(j["totals"]["triangles_per_second"], 250.0);
  const Json& scan = j["scans"][0];
  EXPECT_EQ(scan["status"], "done");
  EXPECT_EQ(scan["triangles_per_second"], 250.0);
  EXPECT_EQ(scan["report"], "report/statues/koala.drc/report.json");
  EXPECT_EQ(scan["thumbnail"], "report/statues/koala.drc/thumbnail.png");
  EXPECT_EQ(scan["viewer"], "report/statues/koala.drc/view.js");
  EXPECT_TRUE(scan["stretch"].is_null());
  EXPECT_TRUE(scan["distance"]["diagonal"].is_null());
  EXPECT_EQ(j["scans"][1]["sentence"], "It is empty.");
  EXPECT_EQ(j["scans"][1]["log"], "bad.drc.log");
  EXPECT_TRUE(j["scans"][1]["triangles"].is_null());
}

TEST(ReportHtml, LetsNoNameBreakOut) {
  BatchReport report;
  const std::string name = "</script><script>alert(1)</script>\n\"'&<!--.drc";
  report.scans = {done_scan(name)};
  report.scans[0].sentence = "</script>";
  report.scans[0].figures.warnings = {"<b>\xff</b>"};
  sum_up(report, 0.0, 0.0);
  const std::string html = html_of(report);
  std::size_t scripts = 0;
  for (std::size_t i = html.find("<script"); i != std::string::npos;
       i = html.find("<script", i + 1)) {
    ++scripts;
  }
  EXPECT_EQ(scripts, 2U);
  EXPECT_EQ(html.find("alert(1)<"), std::string::npos);
  const Json data = data_of(html);
  const Json& row = data["rows"][0];
  ASSERT_EQ(row.size(), data["columns"].size());
  EXPECT_EQ(row[0], name);
  EXPECT_EQ(Json::parse(json_of(report))["scans"][0]["id"], name);
}

TEST(ReportHtml, LinksToNamesThatAreNoText) {
  BatchReport report;
  report.scans = {done_scan("caf\xe9.drc"), done_scan("caf\xc3\xa9.drc")};
  sum_up(report, 0.0, 0.0);
  const Json data = data_of(html_of(report));
  EXPECT_EQ(data["columns"][1], "link");
  EXPECT_EQ(data["rows"][0][1], "caf%E9.drc");
  EXPECT_TRUE(data["rows"][1][1].is_null());  // the page can tell
  EXPECT_EQ(Json::parse(json_of(report))["scans"][0]["link"], "caf%E9.drc");
}

TEST(ReportHtml, IsWholeAndNeedsNothingElse) {
  const std::string html = html_of({});
  EXPECT_EQ(html.find("{{"), std::string::npos);
  EXPECT_EQ(html.find("http:"), html.find("http://www.w3.org/2000/svg"));
  EXPECT_EQ(html.find("https:"), std::string::npos);
  EXPECT_NE(html.find(page_assets::kScript.substr(0, 200)), std::string::npos);
  EXPECT_NE(html.find("prefers-color-scheme"), std::string::npos);
  EXPECT_EQ(html.substr(html.size() - 8), "</html>\n");
  for (const char c : html) {
    ASSERT_TRUE(c == '\n' || (c >= ' ' && c <= '~'));
  }
}

}  // namespace
}  // namespace rattan
