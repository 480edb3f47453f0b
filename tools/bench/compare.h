// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

namespace rattan {

/// Reads a file in Google Benchmark's JSON. Throws InputError.
nlohmann::ordered_json read_benchmarks(const std::string& path);

/// Two documents in Google Benchmark's JSON beside each other: for each figure old, new and new /
/// old of the wall time (of the median of the repeats) and of the counters that a run shouldn't
/// raise. A figure is worse if it grew by more than `tolerance` (0.1: a tenth) and, of repeats, the
/// best new is no better than the worst old; better likewise. What is in one of them only is named.
std::string compare_benchmarks(const nlohmann::ordered_json& before,
                               const nlohmann::ordered_json& now, double tolerance);

}  // namespace rattan
