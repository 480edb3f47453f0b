// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "jobs/report.h"

namespace rattan {

struct ThroughputOptions {
  std::vector<std::uint64_t> sizes;  ///< triangles of each synthesised scan
  double ratio = 0.03125;            ///< faces per triangle: 1.6 million to 50,000
  std::vector<int> threads = {0};
  int repeats = 1;  ///< the fastest run counts
  std::string directory;
};

struct ThroughputRow {
  std::uint64_t triangles = 0;
  int threads = 0;
  RemeshReport report;  ///< of the fastest run
  double draco_seconds =
      -1.0;  ///< wall time of draco_encoder on the same file; -1 if it is missing
};

/// Synthesises each scan once, remeshes it with each thread count, and times the stock
/// draco_encoder on the same file in the same run.
std::vector<ThroughputRow> measure_throughput(const ThroughputOptions& options);

/// A readable table; JSON in Google Benchmark's format.
std::string throughput_table(const std::vector<ThroughputRow>& rows);
std::string throughput_json(const std::vector<ThroughputRow>& rows);

}  // namespace rattan
