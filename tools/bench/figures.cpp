// SPDX-License-Identifier: MIT
#include "tools/bench/figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <sched.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "jobs/version.h"

namespace rattan {

namespace {

using Json = nlohmann::ordered_json;

/// The value of the first line "name : value" of a file in /proc.
std::string proc_value(const char* path, std::string_view name) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    const std::size_t colon = line.find(':');
    if (colon != std::string::npos && line.compare(0, name.size(), name) == 0) {
      const std::size_t begin = line.find_first_not_of(" \t", colon + 1);
      return begin == std::string::npos ? "" : line.substr(begin);
    }
  }
  return {};
}

int processors() {
  cpu_set_t set;
  CPU_ZERO(&set);
  return sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1;
}

Json context() {
  const std::time_t now = std::time(nullptr);
  utsname system{};
  uname(&system);
  std::array<double, 3> load{};
  if (getloadavg(load.data(), 3) != 3) {
    load = {};
  }
  const std::string mhz = proc_value("/proc/cpuinfo", "cpu MHz");
  std::error_code unreadable;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", unreadable);
  Json j;
  j["date"] = fmt::format("{:%Y-%m-%dT%H:%M:%S}+00:00", fmt::gmtime(now));
  j["host_name"] = system.nodename;
  j["executable"] = self.string();
  j["num_cpus"] = processors();
  j["mhz_per_cpu"] = mhz.empty() ? 0 : std::lround(std::strtod(mhz.c_str(), nullptr));
  j["cpu_scaling_enabled"] = false;
  j["caches"] = Json::array();
  j["load_avg"] = load;
#ifdef NDEBUG
  j["library_build_type"] = "release";
#else
  j["library_build_type"] = "debug";
#endif
  j.update(machine_context());
  return j;
}

/// Google Benchmark keeps what programs add as text.
double number(const Json& context, const char* name) {
  const auto found = context.find(name);
  return found == context.end() ? 0.0
         : found->is_string()   ? std::strtod(found->get<std::string>().c_str(), nullptr)
                                : found->get<double>();
}

void add_values(Json& entry, const Measure& m) {
  entry["real_time"] = m.seconds;
  entry["cpu_time"] = m.cpu_seconds;
  entry["time_unit"] = "s";
  for (const auto& [name, value] : m.counters) {
    entry[name] = value;
  }
}

/// Each value apart, as Google Benchmark does it.
template <class Choose>
Measure aggregate(const std::vector<Measure>& repeats, const Choose& choose) {
  const auto over = [&](const auto& value) {
    std::vector<double> values;
    values.reserve(repeats.size());
    for (const Measure& m : repeats) {
      values.push_back(value(m));
    }
    return choose(spread(std::move(values)));
  };
  Measure result;
  result.seconds = over([](const Measure& m) { return m.seconds; });
  result.cpu_seconds = over([](const Measure& m) { return m.cpu_seconds; });
  for (std::size_t c = 0; c < repeats[0].counters.size(); ++c) {
    result.counters.emplace_back(repeats[0].counters[c].first,
                                 over([c](const Measure& m) { return m.counters[c].second; }));
  }
  return result;
}

}  // namespace

Json machine_context() {
  utsname system{};
  uname(&system);
  Json j;
  j["cpu_model"] = proc_value("/proc/cpuinfo", "model name");
  j["memory_bytes"] = static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) *
                      static_cast<std::uint64_t>(sysconf(_SC_PAGE_SIZE));
  j["kernel"] = std::string(system.sysname) + " " + system.release;
  j["rattan_version"] = version();
  j["rattan_commit"] = commit();
  return j;
}

Spread spread(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return {values.front(), 0.5 * (values[(n - 1) / 2] + values[n / 2]), values.back()};
}

Spread seconds_of(const std::vector<Measure>& repeats) {
  std::vector<double> values;
  values.reserve(repeats.size());
  for (const Measure& m : repeats) {
    values.push_back(m.seconds);
  }
  return spread(std::move(values));
}

Json benchmark_json(const std::vector<Figure>& figures) {
  Json document;
  document["context"] = context();
  Json& entries = document["benchmarks"] = Json::array();
  for (std::size_t family = 0; family < figures.size(); ++family) {
    const Figure& figure = figures[family];
    const auto entry = [&](const std::string& name, const char* type) {
      Json e;
      e["name"] = name;
      e["family_index"] = family;
      e["per_family_instance_index"] = 0;
      e["run_name"] = figure.name;
      e["run_type"] = type;
      e["repetitions"] = figure.repeats.size();
      return e;
    };
    for (std::size_t k = 0; k < figure.repeats.size(); ++k) {
      Json e = entry(figure.name, "iteration");
      e["repetition_index"] = k;
      e["threads"] = figure.threads;
      e["iterations"] = 1;
      add_values(e, figure.repeats[k]);
      entries.push_back(std::move(e));
    }
    if (figure.repeats.size() > 1) {
      const auto add = [&](const char* name, double Spread::*which) {
        Json e = entry(figure.name + "_" + name, "aggregate");
        e["threads"] = figure.threads;
        e["aggregate_name"] = name;
        e["aggregate_unit"] = "time";
        e["iterations"] = figure.repeats.size();
        add_values(e, aggregate(figure.repeats, [&](const Spread& s) { return s.*which; }));
        entries.push_back(std::move(e));
      };
      add("min", &Spread::min);
      add("median", &Spread::median);
      add("max", &Spread::max);
    }
  }
  return document;
}

std::string describe_context(const Json& document) {
  const Json context = document.value("context", Json::object());
  return fmt::format("{} x {}, {:.0f} GiB, load {:.1f}, Rattan {} {}, {}",
                     context.value("num_cpus", 0), context.value("cpu_model", "unknown processor"),
                     number(context, "memory_bytes") / (1 << 30),
                     context.contains("load_avg") && !context["load_avg"].empty()
                         ? context["load_avg"][0].get<double>()
                         : 0.0,
                     context.value("rattan_version", "of unknown version"),
                     context.value("rattan_commit", ""), context.value("date", "undated"));
}

}  // namespace rattan
