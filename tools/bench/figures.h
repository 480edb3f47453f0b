// SPDX-License-Identifier: MIT
#pragma once

// What is measured, as Google Benchmark writes it down.

#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace rattan {

/// One repeat of one figure.
struct Measure {
  double seconds = 0.0;  ///< wall
  double cpu_seconds = 0.0;
  /// By name, e.g. "items_per_second"; the same names in each repeat.
  std::vector<std::pair<std::string, double>> counters;
};

struct Figure {
  std::string name;  ///< e.g. "remesh/triangles:100000/threads:2/stage:field"
  int threads = 1;
  std::vector<Measure> repeats;
};

struct Spread {
  double min = 0.0;
  double median = 0.0;
  double max = 0.0;
};
/// Of at least one value.
Spread spread(std::vector<double> values);
/// Of the repeats' wall seconds.
Spread seconds_of(const std::vector<Measure>& repeats);

/// A document in Google Benchmark's JSON: the machine and the commit as context, an entry for each
/// repeat, and of several their least, median and largest.
nlohmann::ordered_json benchmark_json(const std::vector<Figure>& figures);

/// Of this machine and program, what Google Benchmark doesn't tell itself.
nlohmann::ordered_json machine_context();

/// "2 x AMD EPYC, 16 GiB, Rattan 0.1.0 abcdef": a document's context in a line.
std::string describe_context(const nlohmann::ordered_json& document);

}  // namespace rattan
