// SPDX-License-Identifier: MIT
#pragma once

// All that is known of a batch, scan by scan.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "jobs/batch/batch_item.h"

namespace rattan {

enum class ScanStatus : std::uint8_t {
  kDone,
  kUnusable,     ///< the scan, or what is asked of it: exit 3 or 2
  kResource,     ///< exit 4
  kDefect,       ///< exit 1
  kInterrupted,  ///< exit 75, or nobody is left who could say how it ended
  kRunning,
  kPending
};
inline constexpr std::size_t kScanStatuses = 7;
/// "done", "unusable", ...
const char* name_of(ScanStatus status);

/// A figure that may be unknown.
using Count = std::optional<std::uint64_t>;
using Measure = std::optional<double>;

/// Of the remesh, or of the first if there are several; from the scan's own report.
struct RemeshFigures {
  Count triangles;  ///< of the scan as repaired, like the next
  Count vertices;
  Count faces;
  Count quads;
  Count irregular_vertices;
  Count singularities;  ///< triangles where the parameterization is singular
  Measure stretch;
  Measure shear;
  Measure scaled_jacobian;  ///< mean
  Measure target_faces;
  std::optional<bool> target_met;
  Measure to_input_max, to_input_rms, from_input_max, from_input_rms, diagonal;
  std::vector<std::pair<std::string, std::uint64_t>> repairs;  ///< those that are not zero
  std::vector<std::string> warnings;
};

/// Names are any bytes.
struct ReportedScan {
  std::string id;
  std::string scan;
  std::string options;
  std::string host;
  std::string slurm;
  std::string sentence;  ///< of the error
  ScanStatus status = ScanStatus::kPending;
  std::optional<int> exit;
  int attempts = 0;
  Measure started;  ///< seconds since 1970; of the last attempt
  Measure ended;
  Measure seconds;
  Measure cpu_seconds;
  Count peak_rss_bytes;
  Count output_bytes;  ///< all sizes together
  RemeshFigures figures;
  std::vector<std::string> outputs;     ///< paths below the batch's folder
  bool has_report = false;              ///< DIR/report/<id>/report.json
  bool has_log = false;                 ///< DIR/<id>.log
  std::vector<std::string> thumbnails;  ///< file names in DIR/report/<id>; one a size
  std::vector<std::string> viewers;     ///< likewise

  Measure triangles_per_second() const;
};

struct ReportTotals {
  std::uint64_t scans = 0;
  std::array<std::uint64_t, kScanStatuses> of_status{};
  std::uint64_t triangles = 0;
  std::uint64_t faces = 0;
  std::uint64_t quads = 0;
  std::uint64_t output_bytes = 0;
  double cpu_seconds = 0.0;   ///< of all attempts
  double scan_seconds = 0.0;  ///< likewise, wall time
  double wall_seconds = 0.0;  ///< during which anything was at work
  double triangles_per_second = 0.0;
  std::uint64_t peak_rss_bytes = 0;
  std::uint64_t warnings = 0;
  std::uint64_t repairs = 0;

  std::uint64_t with(ScanStatus status) const {
    return of_status[static_cast<std::size_t>(status)];
  }
};

/// One step of the throughput chart: what finished scans had done in it, if each worked evenly.
/// Time in which nothing was at work is left out.
struct ThroughputStep {
  double time = 0.0;  ///< its begin, seconds since 1970
  double seconds = 0.0;
  double triangles_per_second = 0.0;
  std::uint64_t scans = 0;  ///< ended
};

struct BatchReport {
  std::string directory;  ///< absolute
  double created = 0.0;   ///< seconds since 1970
  ReportTotals totals;
  std::vector<ReportedScan> scans;  ///< by id
  std::vector<ThroughputStep> throughput;
};

/// Reads journal and reports. Throws InputError where no batch has ever run.
BatchReport read_batch_report(const std::string& directory, std::span<const BatchItem> items = {});

/// Sums, and the throughput over time, from the scans; `attempts` are the processor and wall
/// seconds of all attempts.
void sum_up(BatchReport& report, double attempts_cpu, double attempts_wall);

}  // namespace rattan
