// SPDX-License-Identifier: MIT
#include "jobs/report_page/report_text.h"

#include <array>
#include <cmath>
#include <ctime>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "engine/core/errors.h"
#include "jobs/batch/name_text.h"
#include "jobs/report_page/page_assets.h"
#include "jobs/version.h"

namespace rattan {
namespace {

using Json = nlohmann::ordered_json;

/// One line. For a page, without "<", which could end its script.
std::string line_of(const Json& json, bool in_page) {
  std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  if (in_page) {
    for (std::size_t i = text.find('<'); i != std::string::npos; i = text.find('<', i)) {
      text.replace(i, 1, "\\u003c");
    }
  }
  return text;
}

template <class T>
Json value_or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json();
}

/// To the millisecond: more is noise, and takes room.
Json rounded(const Measure& seconds) {
  return seconds ? Json(std::round(*seconds * 1e3) / 1e3) : Json();
}

Json text_or_null(const std::string& text) {
  return text.empty() ? Json() : Json(text);
}

/// "2026-11-22T17:20:01Z".
std::string iso_time(double time) {
  const auto seconds = static_cast<std::time_t>(time);
  std::tm utc{};
  ::gmtime_r(&seconds, &utc);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text.data();
}

Json totals_json(const ReportTotals& t) {
  Json j;
  j["scans"] = t.scans;
  for (std::size_t s = 0; s < kScanStatuses; ++s) {
    j[name_of(static_cast<ScanStatus>(s))] = t.of_status[s];
  }
  j["triangles"] = t.triangles;
  j["faces"] = t.faces;
  j["quads"] = t.quads;
  j["output_bytes"] = t.output_bytes;
  j["cpu_seconds"] = rounded(t.cpu_seconds);
  j["scan_seconds"] = rounded(t.scan_seconds);
  j["wall_seconds"] = rounded(t.wall_seconds);
  j["triangles_per_second"] = rounded(t.triangles_per_second);
  j["peak_rss_bytes"] = t.peak_rss_bytes;
  j["warnings"] = t.warnings;
  j["repairs"] = t.repairs;
  return j;
}

Json throughput_json(const std::vector<ThroughputStep>& steps) {
  Json j = Json::array();
  for (const ThroughputStep& step : steps) {
    j.push_back({{"time", rounded(step.time)},
                 {"seconds", rounded(step.seconds)},
                 {"triangles_per_second", rounded(step.triangles_per_second)},
                 {"scans", step.scans}});
  }
  return j;
}

Json head_json(const BatchReport& report) {
  Json j;
  j["rattan"] = {{"version", version()}, {"commit", commit()}};
  j["created"] = iso_time(report.created);
  j["directory"] = report.directory;
  j["totals"] = totals_json(report.totals);
  return j;
}

std::string folder_of(const ReportedScan& scan) {
  return "report/" + scan.id + "/";
}

Json first_of(const ReportedScan& scan, const std::vector<std::string>& names) {
  return names.empty() ? Json() : Json(folder_of(scan) + names[0]);
}

Json scan_json(const ReportedScan& s) {
  const RemeshFigures& f = s.figures;
  Json repairs = Json::object();
  for (const auto& [name, count] : f.repairs) {
    repairs[name] = count;
  }
  Json j;
  j["id"] = s.id;
  j["link"] = link_to(s.id);
  j["scan"] = s.scan;
  j["output"] = s.outputs.empty() ? Json() : Json(s.outputs[0]);
  j["outputs"] = s.outputs;
  j["output_bytes"] = value_or_null(s.output_bytes);
  j["status"] = name_of(s.status);
  j["exit"] = value_or_null(s.exit);
  j["sentence"] = text_or_null(s.sentence);
  j["attempts"] = s.attempts;
  j["options"] = s.options;
  j["host"] = text_or_null(s.host);
  j["slurm"] = text_or_null(s.slurm);
  j["started"] = rounded(s.started);
  j["ended"] = rounded(s.ended);
  j["seconds"] = rounded(s.seconds);
  j["cpu_seconds"] = rounded(s.cpu_seconds);
  j["triangles_per_second"] = rounded(s.triangles_per_second());
  j["peak_rss_bytes"] = value_or_null(s.peak_rss_bytes);
  j["triangles"] = value_or_null(f.triangles);
  j["vertices"] = value_or_null(f.vertices);
  j["faces"] = value_or_null(f.faces);
  j["quads"] = value_or_null(f.quads);
  j["target_faces"] = value_or_null(f.target_faces);
  j["target_met"] = value_or_null(f.target_met);
  j["irregular_vertices"] = value_or_null(f.irregular_vertices);
  j["singularities"] = value_or_null(f.singularities);
  j["stretch"] = value_or_null(f.stretch);
  j["shear"] = value_or_null(f.shear);
  j["mean_scaled_jacobian"] = value_or_null(f.scaled_jacobian);
  j["distance"] = {{"to_input_max", value_or_null(f.to_input_max)},
                   {"to_input_rms", value_or_null(f.to_input_rms)},
                   {"from_input_max", value_or_null(f.from_input_max)},
                   {"from_input_rms", value_or_null(f.from_input_rms)},
                   {"diagonal", value_or_null(f.diagonal)}};
  j["repairs"] = std::move(repairs);
  j["warnings"] = f.warnings;
  j["report"] = s.has_report ? Json(folder_of(s) + "report.json") : Json();
  j["thumbnail"] = first_of(s, s.thumbnails);
  j["viewer"] = first_of(s, s.viewers);
  j["log"] = s.has_log ? Json(s.id + ".log") : Json();
  return j;
}

/// Columns of the page's rows; data.js names them alike.
constexpr const char* kColumns[] = {
    "id",       "link",         "scan",       "status",    "exit",          "sentence",
    "attempts", "options",      "host",       "slurm",     "started",       "ended",
    "seconds",  "cpu_seconds",  "peak_rss",   "triangles", "vertices",      "faces",
    "quads",    "target_faces", "target_met", "irregular", "singularities", "stretch",
    "shear",    "jacobian",     "to_max",     "to_rms",    "from_max",      "from_rms",
    "diagonal", "output_bytes", "outputs",    "repairs",   "warnings",      "has_report",
    "has_log",  "thumbnails",   "viewers"};

Json row_json(const ReportedScan& s) {
  const RemeshFigures& f = s.figures;
  Json repairs = Json::array();
  for (const auto& [name, count] : f.repairs) {
    repairs.push_back({name, count});
  }
  // The page makes the link from an id that is text.
  Json row = {s.id,
              is_utf8(s.id) ? Json() : Json(link_to(s.id)),
              s.scan,
              static_cast<int>(s.status),
              value_or_null(s.exit),
              text_or_null(s.sentence),
              s.attempts,
              s.options,
              text_or_null(s.host),
              text_or_null(s.slurm),
              rounded(s.started),
              rounded(s.ended),
              rounded(s.seconds),
              rounded(s.cpu_seconds),
              value_or_null(s.peak_rss_bytes),
              value_or_null(f.triangles),
              value_or_null(f.vertices),
              value_or_null(f.faces),
              value_or_null(f.quads),
              value_or_null(f.target_faces),
              value_or_null(f.target_met),
              value_or_null(f.irregular_vertices),
              value_or_null(f.singularities),
              value_or_null(f.stretch),
              value_or_null(f.shear),
              value_or_null(f.scaled_jacobian),
              value_or_null(f.to_input_max),
              value_or_null(f.to_input_rms),
              value_or_null(f.from_input_max),
              value_or_null(f.from_input_rms),
              value_or_null(f.diagonal),
              value_or_null(s.output_bytes)};
  Json outputs = Json::array();
  for (const std::string& output : s.outputs) {
    outputs.push_back(is_utf8(output) ? Json(output) : Json::array({output, link_to(output)}));
  }
  row.push_back(s.outputs.size() == 1 && s.outputs[0] == s.id ? Json() : std::move(outputs));
  row.push_back(repairs.empty() ? Json() : std::move(repairs));
  row.push_back(f.warnings.empty() ? Json() : Json(f.warnings));
  row.push_back(s.has_report ? 1 : 0);
  row.push_back(s.has_log ? 1 : 0);
  row.push_back(s.thumbnails);
  row.push_back(s.viewers);
  ensure(row.size() == std::size(kColumns), "a row has all columns");
  return row;
}

void write_data(const BatchReport& report, const TextSink& sink) {
  Json head = head_json(report);
  head["statuses"] = Json::array();
  for (std::size_t s = 0; s < kScanStatuses; ++s) {
    head["statuses"].push_back(name_of(static_cast<ScanStatus>(s)));
  }
  head["throughput"] = throughput_json(report.throughput);
  head["columns"] = kColumns;
  std::string text = line_of(head, true);
  text.pop_back();
  sink(text);
  sink(",\"rows\":[");
  for (std::size_t i = 0; i < report.scans.size(); ++i) {
    sink(i == 0 ? "\n" : ",\n");
    sink(line_of(row_json(report.scans[i]), true));
  }
  sink("\n]}");
}

}  // namespace

std::string link_to(std::string_view path) {
  std::string link;
  for (const char c : path) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       c == '-' || c == '_' || c == '.' || c == '~' || c == '/';
    if (plain) {
      link += c;
    } else {
      link += fmt::format("%{:02X}", static_cast<unsigned>(static_cast<unsigned char>(c)));
    }
  }
  return link;
}

void write_report_json(const BatchReport& report, const TextSink& sink) {
  std::string text = head_json(report).dump(1, ' ', false, Json::error_handler_t::replace);
  text.resize(text.size() - 2);  // "\n}"
  sink(text);
  sink(",\n \"scans\": [");
  for (std::size_t i = 0; i < report.scans.size(); ++i) {
    sink(i == 0 ? "\n  " : ",\n  ");
    sink(line_of(scan_json(report.scans[i]), false));
  }
  sink("\n ],\n \"throughput\": ");
  sink(line_of(throughput_json(report.throughput), false));
  sink("\n}\n");
}

void write_report_html(const BatchReport& report, const TextSink& sink) {
  std::string_view page = page_assets::kPage;
  const auto up_to = [&](std::string_view mark) {
    const std::size_t at = page.find(mark);
    ensure(at != std::string_view::npos, "the page has its marks");
    sink(page.substr(0, at));
    page.remove_prefix(at + mark.size());
  };
  up_to("/*{{style}}*/");
  sink(page_assets::kStyle);
  up_to("{{data}}");
  write_data(report, sink);
  up_to("/*{{script}}*/");
  sink(page_assets::kScript);
  sink(page);
}

}  // namespace rattan
