// SPDX-License-Identifier: MIT
#include "tools/bench/compare.h"

#include <algorithm>
#include <fstream>
#include <map>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "engine/core/errors.h"
#include "tools/bench/figures.h"

namespace rattan {

namespace {

using Json = nlohmann::ordered_json;

// Of these less is better, as of time.
constexpr const char* kCounters[] = {"peak_rss_bytes", "times_draco_encoder"};

struct Values {
  std::string unit;  ///< "s", "bytes" or none
  std::vector<double> repeats;
  std::vector<double> cpu;  ///< of times
};

/// Names in the order of the document.
struct Named {
  std::vector<std::string> names;
  std::map<std::string, Values> values;

  Values& add(const std::string& name, const std::string& unit, double value) {
    const auto [at, fresh] = values.try_emplace(name, Values{unit, {}, {}});
    if (fresh) {
      names.push_back(name);
    }
    at->second.repeats.push_back(value);
    return at->second;
  }
};

double unit_seconds(const std::string& unit) {
  return unit == "s" ? 1.0 : unit == "ms" ? 1e-3 : unit == "us" ? 1e-6 : 1e-9;
}

Named figures_of(const Json& document) {
  Named named;
  for (const Json& entry : document.at("benchmarks")) {
    if (entry.value("run_type", "iteration") != "iteration" ||
        entry.value("error_occurred", false)) {
      continue;
    }
    const std::string name = entry.value("run_name", entry.value("name", ""));
    const double unit = unit_seconds(entry.value("time_unit", "ns"));
    named.add(name, "s", entry.at("real_time").get<double>() * unit)
        .cpu.push_back(entry.at("cpu_time").get<double>() * unit);
    for (const char* counter : kCounters) {
      if (entry.contains(counter)) {
        const bool bytes = std::string_view(counter).ends_with("bytes");
        named.add(name + " " + counter, bytes ? "bytes" : "", entry[counter].get<double>());
      }
    }
  }
  return named;
}

double quotient(double now, double before) {
  return before > 0.0 ? now / before : now > 0.0 ? 1e9 : 1.0;
}

std::string readable(double value, const std::string& unit) {
  if (unit == "s") {
    for (const auto& [factor, name] :
         {std::pair{1.0, "s"}, std::pair{1e-3, "ms"}, std::pair{1e-6, "us"}}) {
      if (value >= factor) {
        return fmt::format("{:.3g} {}", value / factor, name);
      }
    }
    return fmt::format("{:.3g} ns", value * 1e9);
  }
  if (unit == "bytes") {
    return fmt::format("{:.4g} MiB", value / (1 << 20));
  }
  return fmt::format("{:.3g}", value);
}

/// A run that is missing is named alone, without its stages and counters.
std::string only_in(const char* which, const Named& here, const Named& there) {
  std::string text;
  for (const std::string& name : here.names) {
    const std::string run = name.substr(0, std::min(name.find(' '), name.find("/stage:")));
    if (!there.values.contains(name) && (name == run || there.values.contains(run))) {
      text += fmt::format("only in the {}: {}\n", which, name);
    }
  }
  return text;
}

}  // namespace

Json read_benchmarks(const std::string& path) {
  std::ifstream file(path);
  if (!file) {
    throw InputError(path, "", "it cannot be read", "Give a file that --json wrote");
  }
  try {
    Json document = Json::parse(file);
    figures_of(document);
    return document;
  } catch (const Json::exception& e) {
    throw InputError(path, "", std::string("it is not Google Benchmark's JSON: ") + e.what(),
                     "Give a file that --json wrote");
  }
}

std::string compare_benchmarks(const Json& before, const Json& now, double tolerance) {
  const Named old_figures = figures_of(before);
  const Named new_figures = figures_of(now);
  std::size_t width = 6;
  for (const std::string& name : new_figures.names) {
    width = std::max(width, name.size());
  }
  std::string text =
      fmt::format("old: {}\nnew: {}\n{:<{}} {:>12} {:>12} {:>7} {:>9}\n", describe_context(before),
                  describe_context(now), "figure", width, "old", "new", "ratio", "cpu ratio");
  std::vector<std::string> worse;
  std::size_t better = 0;
  std::size_t compared = 0;
  for (const std::string& name : new_figures.names) {
    const auto found = old_figures.values.find(name);
    if (found == old_figures.values.end()) {
      continue;
    }
    const Values& values = new_figures.values.at(name);
    const Spread was = spread(found->second.repeats);
    const Spread is = spread(values.repeats);
    const double ratio = quotient(is.median, was.median);
    const bool is_worse = ratio > 1.0 + tolerance && is.min > was.max;
    const bool is_better = ratio < 1.0 / (1.0 + tolerance) && is.max < was.min;
    const std::string cpu = values.cpu.empty()
                                ? ""
                                : fmt::format("{:.3f}", quotient(spread(values.cpu).median,
                                                                 spread(found->second.cpu).median));
    text +=
        fmt::format("{:<{}} {:>12} {:>12} {:>7.3f} {:>9}{}\n", name, width,
                    readable(was.median, values.unit), readable(is.median, values.unit), ratio, cpu,
                    is_worse    ? "  worse"
                    : is_better ? "  better"
                                : "");
    ++compared;
    better += is_better ? 1 : 0;
    if (is_worse) {
      worse.push_back(name);
    }
  }
  text += only_in("old", old_figures, new_figures) + only_in("new", new_figures, old_figures);
  text += fmt::format("{} figures: {} better, {} worse by more than {:.3g} %{}\n", compared, better,
                      worse.size(), 100.0 * tolerance, worse.empty() ? "" : ":");
  for (const std::string& name : worse) {
    text += "  " + name + "\n";
  }
  return text;
}

}  // namespace rattan
