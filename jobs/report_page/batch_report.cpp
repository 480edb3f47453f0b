// SPDX-License-Identifier: MIT
#include "jobs/report_page/batch_report.h"

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>
#include <unordered_set>

#include <nlohmann/json.hpp>

#include "engine/core/errors.h"
#include "jobs/batch/claims.h"
#include "jobs/batch/journal.h"
#include "jobs/output_names.h"

namespace rattan {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// What hangs at a path of keys; null if anything on the way is missing or of another kind.
template <class... Keys>
const Json* at(const Json& root, const Keys&... keys) {
  const Json* j = &root;
  for (const char* key : {keys...}) {
    if (!j->is_object()) {
      return nullptr;
    }
    const auto found = j->find(key);
    if (found == j->end()) {
      return nullptr;
    }
    j = &*found;
  }
  return j;
}

template <class... Keys>
Count count(const Json& root, const Keys&... keys) {
  const Json* j = at(root, keys...);
  return j != nullptr && j->is_number_unsigned() ? Count(j->get<std::uint64_t>()) : Count();
}

template <class... Keys>
Measure measure(const Json& root, const Keys&... keys) {
  const Json* j = at(root, keys...);
  return j != nullptr && j->is_number() ? Measure(j->get<double>()) : Measure();
}

RemeshFigures figures_of(const Json& r) {
  RemeshFigures f;
  f.triangles = count(r, "input", "triangles");
  f.vertices = count(r, "input", "vertices");
  f.faces = count(r, "output", "faces");
  f.quads = count(r, "output", "quads");
  f.irregular_vertices = count(r, "output", "irregular_vertices");
  f.singularities = count(r, "singularities", "triangles");
  f.stretch = measure(r, "distortion", "stretch");
  f.shear = measure(r, "distortion", "shear");
  f.scaled_jacobian = measure(r, "output", "mean_scaled_jacobian");
  f.target_faces = measure(r, "output", "target_faces");
  if (const Json* met = at(r, "output", "target_met"); met != nullptr && met->is_boolean()) {
    f.target_met = met->get<bool>();
  }
  f.to_input_max = measure(r, "distance", "to_input_max");
  f.to_input_rms = measure(r, "distance", "to_input_rms");
  f.from_input_max = measure(r, "distance", "from_input_max");
  f.from_input_rms = measure(r, "distance", "from_input_rms");
  f.diagonal = measure(r, "distance", "diagonal");
  if (const Json* repaired = at(r, "input", "repaired"); repaired != nullptr) {
    for (const auto& [name, value] : repaired->items()) {
      if (value.is_number_unsigned() && value.get<std::uint64_t>() > 0) {
        f.repairs.emplace_back(name, value.get<std::uint64_t>());
      }
    }
  }
  if (const Json* warnings = at(r, "warnings"); warnings != nullptr && warnings->is_array()) {
    for (const Json& warning : *warnings) {
      if (warning.is_string()) {
        f.warnings.push_back(warning.get<std::string>());
      }
    }
  }
  return f;
}

/// Names of a file that there is one of for each size, as `remesh` names them.
std::vector<std::string> names_of_sizes(const Json& r, const std::string& name) {
  constexpr std::pair<const char*, SizeKind> kKinds[] = {{"faces", SizeKind::kFaces},
                                                         {"edge_length", SizeKind::kEdgeLength},
                                                         {"ratio", SizeKind::kRatio}};
  for (const auto& [key, kind] : kKinds) {
    const Json* sizes = at(r, "options", key);
    if (sizes != nullptr && sizes->is_array() && sizes->size() > 1 &&
        std::all_of(sizes->begin(), sizes->end(), [](const Json& s) { return s.is_number(); })) {
      return expand_names(name, kind, sizes->get<std::vector<double>>());
    }
  }
  return {name};
}

/// Adds what lies in the scan's folder. What can't be read is left unknown.
void read_figures(const std::string& directory, ReportedScan& scan) {
  std::error_code ignored;
  scan.has_log = scan.status != ScanStatus::kDone &&
                 fs::is_regular_file(fs::path(directory) / (scan.id + ".log"), ignored);
  if (scan.status != ScanStatus::kDone) {
    return;  // files there may be of an earlier attempt
  }
  const fs::path folder = fs::path(directory) / "report" / scan.id;
  std::ifstream file(folder / "report.json", std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  const Json report = Json::parse(text.str(), nullptr, false);
  if (!report.is_object()) {
    return;
  }
  scan.has_report = true;
  scan.figures = figures_of(report);
  const auto present = [&](const char* name) {
    std::vector<std::string> names = names_of_sizes(report, name);
    std::erase_if(names,
                  [&](const std::string& n) { return !fs::is_regular_file(folder / n, ignored); });
    return names;
  };
  scan.thumbnails = present("thumbnail.png");
  scan.viewers = present("view.js");
}

/// Most of the time is spent waiting for the file system.
void read_all_figures(const std::string& directory, std::vector<ReportedScan>& scans) {
  constexpr std::size_t kReaders = 8;
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < scans.size(); i = next++) {
      read_figures(directory, scans[i]);
    }
  };
  std::vector<std::jthread> readers;
  for (std::size_t i = 1; i < std::min(kReaders, scans.size() / 16); ++i) {
    readers.emplace_back(work);
  }
  work();
}

ScanStatus status_of(const std::string& directory, const ScanHistory& history) {
  if (history.open()) {
    return Claim::holder(directory, std::string(history.id)) ? ScanStatus::kRunning
                                                             : ScanStatus::kInterrupted;
  }
  switch (history.exit) {
    case 0:
      return ScanStatus::kDone;
    case 2:
    case 3:
      return ScanStatus::kUnusable;
    case 4:
      return ScanStatus::kResource;
    case 75:
      return ScanStatus::kInterrupted;
    default:
      return ScanStatus::kDefect;
  }
}

ReportedScan reported(const std::string& directory, const Journal& journal,
                      const ScanHistory& history) {
  ReportedScan scan;
  scan.id = history.id;
  scan.scan = history.scan;
  scan.options = history.options;
  scan.host = history.host;
  scan.slurm = history.slurm;
  scan.status = status_of(directory, history);
  scan.attempts = history.attempts;
  scan.started = history.started;
  if (history.open()) {
    if (scan.status == ScanStatus::kInterrupted) {
      scan.sentence = "It was cut off, and nobody is left to say why. Run the batch again.";
    }
    return scan;
  }
  scan.sentence = history.sentence;
  scan.exit = history.exit;
  scan.ended = history.ended;
  scan.seconds = history.seconds;
  scan.cpu_seconds = history.cpu_seconds;
  scan.peak_rss_bytes = history.peak_rss_bytes;
  if (scan.status == ScanStatus::kDone) {
    std::uint64_t bytes = 0;
    for (const OutputFile& output : journal.outputs(history)) {
      scan.outputs.push_back(output.path);
      bytes += output.bytes;
    }
    scan.output_bytes = bytes;
  }
  return scan;
}

/// Scans that the journal's newest word on the whole selection counts, and that it has no record
/// of.
std::uint64_t unlisted(const Journal& journal) {
  std::uint64_t total = 0;
  std::uint64_t of_parts = 0;
  for (const BatchRecord& record : journal.batches()) {
    if (record.action == "submit" || (record.action == "begin" && record.shard == 0)) {
      total = std::max(record.total, record.items);
    } else if (record.action == "begin") {
      of_parts = std::max(record.total, record.items);
    }
  }
  total = total > 0 ? total : of_parts;
  return total > journal.scans().size() ? total - journal.scans().size() : 0;
}

}  // namespace

const char* name_of(ScanStatus status) {
  constexpr std::array<const char*, kScanStatuses> kNames{
      "done", "unusable", "resource", "defect", "interrupted", "running", "pending"};
  return kNames.at(static_cast<std::size_t>(status));
}

Measure ReportedScan::triangles_per_second() const {
  return figures.triangles && seconds && *seconds > 0.0
             ? Measure(static_cast<double>(*figures.triangles) / *seconds)
             : Measure();
}

BatchReport read_batch_report(const std::string& directory, std::span<const BatchItem> items) {
  Journal journal(directory);
  journal.refresh();
  if (journal.absent() && items.empty()) {
    throw InputError(directory, "", "no batch has run here",
                     "Give the folder that was given to rattan batch -o");
  }
  BatchReport report;
  report.directory = fs::absolute(directory).lexically_normal().string();
  report.created = unix_seconds();
  std::unordered_set<std::string_view> known;
  for (const ScanHistory& history : journal.scans()) {
    known.insert(history.id);
    report.scans.push_back(reported(directory, journal, history));
  }
  for (const BatchItem& item : items) {
    if (!known.contains(item.id)) {
      ReportedScan scan;
      scan.id = item.id;
      scan.scan = item.scan;
      for (const std::string& word : item.what->words) {
        scan.options += (scan.options.empty() ? "" : " ") + word;
      }
      report.scans.push_back(std::move(scan));
    }
  }
  std::sort(report.scans.begin(), report.scans.end(),
            [](const ReportedScan& a, const ReportedScan& b) { return a.id < b.id; });
  read_all_figures(directory, report.scans);
  double cpu = 0.0;
  double wall = 0.0;
  for (const Journal::Finish& finish : journal.finishes()) {
    cpu += static_cast<double>(finish.cpu_seconds);
    wall += static_cast<double>(finish.seconds);
  }
  sum_up(report, cpu, wall);
  if (items.empty()) {
    const std::uint64_t more = unlisted(journal);
    report.totals.scans += more;
    report.totals.of_status[static_cast<std::size_t>(ScanStatus::kPending)] += more;
  }
  return report;
}

}  // namespace rattan
