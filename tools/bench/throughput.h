// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace rattan {

inline constexpr const char* kDefaultBudget = "default";

struct ThroughputOptions {
  std::vector<std::uint64_t> sizes;  ///< triangles of each synthesised scan
  double ratio = 0.03125;            ///< faces per triangle: 1.6 million to 50,000
  std::vector<int> threads = {0};
  std::vector<std::string> budgets = {kDefaultBudget};  ///< for --memory
  int repeats = 1;                                      ///< the fastest run counts
  std::string directory;
  std::string rattan;  ///< the program
};

struct StageTime {
  std::string name;
  double seconds = 0.0;
  double cpu_seconds = 0.0;
  std::uint64_t passes = 0;
  std::uint64_t bytes_read = 0;
  std::uint64_t bytes_written = 0;
};

/// The fastest run of one size with one thread count and budget. Each run is a process of its own.
struct ThroughputRow {
  std::uint64_t size = 0;  ///< asked for
  std::string budget;
  int threads = 0;
  std::uint64_t triangles = 0;
  std::uint64_t faces = 0;
  std::uint64_t quads = 0;
  std::uint64_t peak_bytes = 0;
  double seconds = 0.0;  ///< wall, of the whole process
  std::vector<StageTime> stages;
  double draco_seconds =
      -1.0;  ///< wall time of draco_encoder on the same file; -1 if it is missing

  double seconds_per_triangle() const { return seconds / static_cast<double>(triangles); }
};

/// Synthesises each scan once, remeshes it with each thread count and budget, and times the stock
/// draco_encoder on the same file in the same run. Throws ResourceError if a run fails.
std::vector<ThroughputRow> measure_throughput(const ThroughputOptions& options);

/// A readable table; JSON in Google Benchmark's format.
std::string throughput_table(const std::vector<ThroughputRow>& rows);
std::string throughput_json(const std::vector<ThroughputRow>& rows);

}  // namespace rattan
