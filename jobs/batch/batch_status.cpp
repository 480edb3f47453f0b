// SPDX-License-Identifier: MIT
#include "jobs/batch/batch_status.h"

#include <algorithm>
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "engine/core/errors.h"
#include "jobs/batch/claims.h"
#include "jobs/batch/journal.h"
#include "jobs/exit_codes.h"

namespace rattan {

namespace {

/// Rates are of the attempts that ended within so many seconds.
constexpr double kLately = 600.0;
constexpr double kLeastWindow = 10.0;

/// The items of all that was asked for: of the newest submission or run over a whole selection; the
/// parts of a run in shards count only where there is neither.
std::uint64_t total_of(const std::vector<BatchRecord>& batches) {
  std::uint64_t whole = 0;
  std::uint64_t parts = 0;
  for (const BatchRecord& r : batches) {
    if (r.action == "submit" || (r.action == "begin" && r.shards == 0)) {
      whole = r.total;
    } else if (r.action == "begin") {
      parts = std::max(parts, r.total);
    }
  }
  return whole > 0 ? whole : parts;
}

/// What has begun and not said that it ended may have died: the holders of claims tell.
std::uint64_t batches_open(const std::vector<BatchRecord>& batches,
                           const std::vector<BatchStatus::Running>& running) {
  std::vector<std::string> holders;
  holders.reserve(running.size());
  for (const BatchStatus::Running& r : running) {
    holders.push_back(fmt::format("{} {}", r.host, r.pid));
  }
  for (const BatchRecord& r : batches) {  // those that have ended since
    if (r.action == "end") {
      std::erase(holders, fmt::format("{} {}", r.host, r.pid));
    }
  }
  std::sort(holders.begin(), holders.end());
  return static_cast<std::uint64_t>(std::unique(holders.begin(), holders.end()) - holders.begin());
}

void set_rates(BatchStatus& status, const Journal& journal) {
  const double now = unix_seconds();
  double first = now;
  double triangles = 0.0;
  double scans = 0.0;
  for (const Journal::Finish& f : journal.finishes()) {
    if (f.time < now - kLately) {
      continue;
    }
    first = std::min(first, f.time - f.seconds);
    if (f.exit == 0) {
      scans += 1.0;
      triangles += f.triangles;
    }
  }
  const double seconds = std::max(now - first, kLeastWindow);
  status.triangles_per_second = triangles / seconds;
  status.scans_per_second = scans / seconds;
  const auto left =
      static_cast<double>(status.pending + status.interrupted + status.running.size());
  if (left == 0.0) {
    status.seconds_left = 0.0;
  } else if (scans >= 1.0 && !status.running.empty()) {
    status.seconds_left = left / status.scans_per_second;
  }
}

std::string duration_text(double seconds) {
  const auto s = static_cast<std::uint64_t>(std::max(seconds, 0.0));
  return s < 100    ? fmt::format("{} s", s)
         : s < 6000 ? fmt::format("{} min", (s + 30) / 60)
                    : fmt::format("{} h {:02} min", s / 3600, s / 60 % 60);
}

const char* kind_of(int exit) {
  switch (exit) {
    case 1:
      return "defect";
    case 4:
      return "resource";
    default:
      return "unusable";
  }
}

int rank_of(int exit) {
  return exit == 1 ? 0 : exit == 4 ? 1 : exit == 3 ? 2 : 3;
}

}  // namespace

BatchStatus read_batch_status(const std::string& directory) {
  Journal journal(directory);
  journal.refresh();
  if (journal.absent()) {
    throw InputError(directory, "", "no batch has run with this folder as its output",
                     "Give the folder that stood after -o");
  }
  const std::vector<BatchRecord> batches = journal.batches();
  BatchStatus status;
  status.directory = directory;
  const double now = unix_seconds();
  for (const Journal::Finish& f : journal.finishes()) {
    status.cpu_seconds += f.cpu_seconds;
  }
  for (const ScanHistory& scan : journal.scans()) {
    const std::string id(scan.id);
    if (scan.open()) {
      if (Claim::holder(directory, id)) {
        status.running.push_back({id, std::string(scan.host), scan.pid, std::string(scan.slurm),
                                  std::max(now - scan.started, 0.0), scan.threads});
      } else {
        ++status.interrupted;
      }
    } else if (scan.exit == 0) {
      ++status.done;
    } else if (scan.exit == kExitInterrupted) {
      ++status.interrupted;
    } else {
      status.failures.push_back({id, scan.exit, scan.attempts, std::string(scan.sentence),
                                 fmt::format("{}/{}.log", directory, id)});
    }
  }
  const std::uint64_t known = journal.scans().size();
  status.items = std::max(total_of(batches), known);
  status.pending = status.items - known;
  std::sort(status.running.begin(), status.running.end(),
            [](const auto& a, const auto& b) { return a.id < b.id; });
  std::sort(status.failures.begin(), status.failures.end(), [](const auto& a, const auto& b) {
    return rank_of(a.exit) != rank_of(b.exit) ? rank_of(a.exit) < rank_of(b.exit) : a.id < b.id;
  });
  status.processes = batches_open(batches, status.running);
  set_rates(status, journal);
  return status;
}

nlohmann::ordered_json to_json(const BatchStatus& s) {
  nlohmann::ordered_json j;
  j["directory"] = s.directory;
  j["items"] = s.items;
  j["done"] = s.done;
  j["failed"] = s.failures.size();
  j["interrupted"] = s.interrupted;
  j["pending"] = s.pending;
  j["running"] = nlohmann::ordered_json::array();
  for (const BatchStatus::Running& r : s.running) {
    j["running"].push_back(
        {{"id", r.id},
         {"host", r.host},
         {"pid", r.pid},
         {"slurm", r.slurm.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(r.slurm)},
         {"seconds", r.seconds},
         {"threads", r.threads}});
  }
  j["failures"] = nlohmann::ordered_json::array();
  for (const BatchStatus::Failure& f : s.failures) {
    j["failures"].push_back({{"id", f.id},
                             {"status", kind_of(f.exit)},
                             {"exit", f.exit},
                             {"attempts", f.attempts},
                             {"sentence", f.sentence},
                             {"log", f.log}});
  }
  j["processes"] = s.processes;
  j["triangles_per_second"] = s.triangles_per_second;
  j["scans_per_second"] = s.scans_per_second;
  j["seconds_left"] =
      s.seconds_left < 0.0 ? nlohmann::ordered_json() : nlohmann::ordered_json(s.seconds_left);
  j["cpu_seconds"] = s.cpu_seconds;
  return j;
}

std::string describe(const BatchStatus& s) {
  constexpr std::size_t kMostLines = 20;
  std::string text = fmt::format(
      "{}: {} scans: {} done, {} failed, {} running, {} interrupted, {} pending\n", s.directory,
      s.items, s.done, s.failures.size(), s.running.size(), s.interrupted, s.pending);
  if (!s.running.empty()) {
    text += fmt::format("rate      {:.1f} scans a minute, {:.0f} triangles a second{}\n",
                        60.0 * s.scans_per_second, s.triangles_per_second,
                        s.seconds_left > 0.0 ? ", " + duration_text(s.seconds_left) + " left" : "");
  }
  std::map<std::string, std::size_t> places;
  for (const BatchStatus::Running& r : s.running) {
    ++places[r.slurm.empty() ? fmt::format("{}, process {}", r.host, r.pid)
                             : fmt::format("{}, Slurm task {}", r.host, r.slurm)];
  }
  std::size_t lines = 0;
  for (const auto& [place, scans] : places) {
    if (++lines > kMostLines) {
      text += fmt::format("          and {} more places\n", places.size() - kMostLines);
      break;
    }
    text += fmt::format("running   {} on {}\n", scans, place);
  }
  lines = 0;
  for (const BatchStatus::Failure& f : s.failures) {
    if (++lines > kMostLines) {
      text += fmt::format("          and {} more failures: see --json\n",
                          s.failures.size() - kMostLines);
      break;
    }
    text += fmt::format("{:<9} {}: {}\n", kind_of(f.exit), f.id, f.sentence);
  }
  return text;
}

}  // namespace rattan
