// SPDX-License-Identifier: MIT
#pragma once

// Throughput of whole runs, each in a process of its own.

#include <cstdint>
#include <string>
#include <vector>

#include "tools/bench/figures.h"

namespace rattan {

inline constexpr const char* kDefaultBudget = "default";

struct ThroughputOptions {
  std::vector<std::uint64_t> sizes;  ///< triangles of each synthesised scan
  double ratio = 0.03125;            ///< faces per triangle: 1.6 million to 50,000
  std::vector<int> threads = {0};    ///< 0: all processors
  std::vector<std::string> budgets = {kDefaultBudget};  ///< for --memory
  int repeats = 1;
  int batch = 0;  ///< also so many scans of each size through `rattan batch`; 0: no
  std::string directory;
  std::string rattan;  ///< the program
};

struct StageTime {
  std::string name;
  double seconds = 0.0;
  double cpu_seconds = 0.0;
  std::uint64_t passes = 0;
  std::uint64_t bytes_read = 0;     ///< from disk
  std::uint64_t bytes_written = 0;  ///< to disk
  std::uint64_t bytes_moved = 0;    ///< of fields and files, to and from memory at work
};

struct RemeshRun {
  double seconds = 0.0;  ///< wall, of the whole process
  double cpu_seconds = 0.0;
  std::uint64_t peak_bytes = 0;
  std::vector<StageTime> stages;
};

/// One size with one thread count and budget.
struct ThroughputRow {
  std::uint64_t size = 0;  ///< triangles asked for
  std::string budget;
  int threads = 0;
  std::uint64_t triangles = 0;
  std::uint64_t faces = 0;
  std::uint64_t quads = 0;
  std::vector<RemeshRun> runs;  ///< one a repeat
  std::vector<Measure> draco;   ///< draco_encoder on the same file, one a repeat; empty: not there

  /// Of the median repeat.
  double seconds() const;
  double seconds_per_triangle() const { return seconds() / static_cast<double>(triangles); }
};

/// N scans of one size through `rattan batch`.
struct BatchRow {
  std::uint64_t size = 0;
  std::string budget;
  int threads = 0;
  int scans = 0;
  std::uint64_t triangles = 0;  ///< of all scans
  std::vector<Measure> runs;
  std::vector<std::uint64_t> peak_bytes;  ///< of the largest process of each run
  std::vector<Measure> draco;             ///< a shell loop of draco_encoder over the same files
};

struct Throughput {
  std::vector<ThroughputRow> rows;
  std::vector<BatchRow> batches;
};

/// Synthesises the scans that aren't there yet, and runs each case `repeats` times, the stock
/// draco_encoder on the same files in between. Throws ResourceError if a run fails.
Throughput measure_throughput(const ThroughputOptions& options);

/// For people; for benchmark_json.
std::string throughput_table(const Throughput& measured);
std::vector<Figure> throughput_figures(const Throughput& measured);

}  // namespace rattan
