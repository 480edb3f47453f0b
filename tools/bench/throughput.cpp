// SPDX-License-Identifier: MIT
#include "tools/bench/throughput.h"

#include <algorithm>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <spawn.h>
#include <sys/wait.h>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "engine/core/errors.h"
#include "engine/core/progress.h"
#include "io/synth/synth.h"
#include "jobs/stage_clock.h"

extern char** environ;

namespace rattan {

namespace {

/// Wall seconds of a command whose output nobody wants; -1 where it isn't there or fails.
double time_command(std::vector<std::string> words) {
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& word : words) {
    argv.push_back(word.data());
  }
  argv.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, 1, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&files, 2, "/dev/null", O_WRONLY, 0);
  const double start = wall_seconds();
  pid_t pid = 0;
  const int failed = posix_spawnp(&pid, argv[0], &files, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  int status = -1;
  if (failed != 0 || waitpid(pid, &status, 0) != pid || status != 0) {
    return -1.0;
  }
  return wall_seconds() - start;
}

ThroughputRow remesh_once(const ThroughputOptions& options, const std::string& scan, int threads,
                          const std::string& budget) {
  const std::string report = options.directory + "/report.json";
  std::vector<std::string> words = {options.rattan,
                                    "remesh",
                                    scan,
                                    "-o",
                                    options.directory + "/remesh.drc",
                                    "--ratio",
                                    fmt::format("{}", options.ratio),
                                    "--threads",
                                    std::to_string(threads),
                                    "--quiet",
                                    "--fresh",
                                    "--report",
                                    report};
  if (budget != kDefaultBudget) {
    words.insert(words.end(), {"--memory", budget});
  }
  ThroughputRow row;
  row.budget = budget;
  row.seconds = time_command(words);
  if (row.seconds < 0.0) {
    throw ResourceError(fmt::format("{}: the run failed. Try: {}", scan, fmt::join(words, " ")));
  }
  std::ifstream file(report);
  const auto j = nlohmann::json::parse(file);
  row.threads = j["threads"];
  row.triangles = j["input"]["triangles"];
  row.faces = j["output"]["faces"];
  row.quads = j["output"]["quads"];
  row.peak_bytes = j["peak_rss_bytes"];
  for (const auto& stage : j["stages"]) {
    row.stages.push_back({stage["name"], stage["seconds"], stage["cpu_seconds"], stage["passes"],
                          stage["bytes_read"], stage["bytes_written"]});
  }
  return row;
}

/// How much dearer a triangle of the largest scan is than one of the smallest.
std::string growth(const std::vector<ThroughputRow>& rows) {
  std::string text;
  for (const ThroughputRow& first : rows) {
    const ThroughputRow* largest = nullptr;
    bool smallest = true;
    for (const ThroughputRow& row : rows) {
      if (row.threads != first.threads || row.budget != first.budget) {
        continue;
      }
      smallest = smallest && row.size >= first.size;
      largest = largest == nullptr || row.size > largest->size ? &row : largest;
    }
    if (smallest && largest->size > first.size) {
      text += fmt::format(
          "{} threads, budget {}: from {} to {} triangles the cost of one grows {:.2f} times "
          "({:.2f} to "
          "{:.2f} microseconds)\n",
          first.threads, first.budget, first.triangles, largest->triangles,
          largest->seconds_per_triangle() / first.seconds_per_triangle(),
          1e6 * first.seconds_per_triangle(), 1e6 * largest->seconds_per_triangle());
    }
  }
  return text;
}

}  // namespace

std::vector<ThroughputRow> measure_throughput(const ThroughputOptions& options) {
  namespace fs = std::filesystem;
  fs::create_directories(options.directory);
  std::vector<ThroughputRow> rows;
  for (const std::uint64_t triangles : options.sizes) {
    const std::string scan = options.directory + fmt::format("/synth_{}.ply", triangles);
    NullProgress quiet;
    if (!fs::exists(scan)) {
      SynthOptions synth;
      synth.triangles = triangles;
      synthesise(synth, scan, quiet);
    }
    double draco = -1.0;
    const std::size_t first = rows.size();
    for (int repeat = 0; repeat < std::max(1, options.repeats); ++repeat) {
      std::size_t at = first;
      for (const int threads : options.threads) {
        for (const std::string& budget : options.budgets) {
          ThroughputRow row = remesh_once(options, scan, threads, budget);
          row.size = triangles;
          if (at == rows.size()) {
            rows.push_back(std::move(row));
          } else if (row.seconds < rows[at].seconds) {
            rows[at] = std::move(row);
          }
          ++at;
        }
      }
      const double once =
          time_command({"draco_encoder", "-i", scan, "-o", options.directory + "/stock.drc"});
      draco = draco < 0.0 ? once : std::min(draco, once);
    }
    for (std::size_t at = first; at < rows.size(); ++at) {
      rows[at].draco_seconds = draco;
    }
  }
  return rows;
}

std::string throughput_table(const std::vector<ThroughputRow>& rows) {
  std::string text;
  for (const ThroughputRow& row : rows) {
    const auto n = static_cast<double>(row.triangles);
    text += fmt::format(
        "{} triangles -> {} faces ({:.1f} % quads), {} threads, budget {}: {:.2f} s, {:.0f} "
        "triangles/s, "
        "peak {} MiB",
        row.triangles, row.faces,
        100.0 * static_cast<double>(row.quads) / std::max(1.0, static_cast<double>(row.faces)),
        row.threads, row.budget, row.seconds, n / row.seconds, row.peak_bytes >> 20U);
    text += row.draco_seconds > 0.0
                ? fmt::format(", {:.2f} times draco_encoder ({:.2f} s)\n",
                              row.seconds / row.draco_seconds, row.draco_seconds)
                : std::string(", draco_encoder not found\n");
    for (const StageTime& s : row.stages) {
      text += fmt::format(
          "  {:<16}{:>8.3f} s {:>5.1f} %  {:>8.3f} cpu s  {:>12.0f} triangles/s  {:>3} passes  "
          "{:>6} MiB read {:>6} written\n",
          s.name, s.seconds, 100.0 * s.seconds / row.seconds, s.cpu_seconds,
          n / std::max(1e-9, s.seconds), s.passes, s.bytes_read >> 20U, s.bytes_written >> 20U);
    }
  }
  return text + growth(rows);
}

std::string throughput_json(const std::vector<ThroughputRow>& rows) {
  nlohmann::ordered_json j;
  j["context"] = {{"library_build_type", "release"}};
  j["benchmarks"] = nlohmann::ordered_json::array();
  const auto add = [&](const std::string& name, double seconds, double cpu, double triangles) {
    j["benchmarks"].push_back({{"name", name},
                               {"run_type", "iteration"},
                               {"iterations", 1},
                               {"real_time", seconds},
                               {"cpu_time", cpu},
                               {"time_unit", "s"},
                               {"items_per_second", triangles / std::max(1e-9, seconds)}});
  };
  for (const ThroughputRow& row : rows) {
    const auto n = static_cast<double>(row.triangles);
    const std::string base =
        fmt::format("remesh/triangles:{}/threads:{}{}", row.size, row.threads,
                    row.budget == kDefaultBudget ? "" : "/memory:" + row.budget);
    double cpu = 0.0;
    for (const StageTime& s : row.stages) {
      add(base + "/stage:" + s.name, s.seconds, s.cpu_seconds, n);
      cpu += s.cpu_seconds;
    }
    add(base, row.seconds, cpu, n);
    if (row.draco_seconds > 0.0) {
      add(fmt::format("draco_encoder/triangles:{}", row.size), row.draco_seconds, row.draco_seconds,
          n);
    }
  }
  return j.dump(2) + "\n";
}

}  // namespace rattan
