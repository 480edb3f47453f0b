// SPDX-License-Identifier: MIT
#include "tools/bench/throughput.h"

#include <algorithm>
#include <array>
#include <fcntl.h>
#include <filesystem>
#include <spawn.h>
#include <sys/wait.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "engine/core/progress.h"
#include "io/synth/synth.h"
#include "jobs/remesh_job.h"
#include "jobs/stage_clock.h"

extern char** environ;

namespace rattan {

namespace {

/// Wall seconds of the stock encoder, or -1 where it isn't installed or fails.
double time_draco_encoder(const std::string& scan, const std::string& output) {
  std::array<std::string, 5> words = {"draco_encoder", "-i", scan, "-o", output};
  std::array<char*, 6> argv{};
  std::transform(words.begin(), words.end(), argv.begin(), [](std::string& w) { return w.data(); });
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
    for (const int threads : options.threads) {
      ThroughputRow row;
      row.triangles = triangles;
      row.threads = threads;
      for (int repeat = 0; repeat < std::max(1, options.repeats); ++repeat) {
        RemeshOptions remesh;
        remesh.scan = scan;
        remesh.output = options.directory + "/remesh.drc";
        remesh.size_kind = SizeKind::kRatio;
        remesh.sizes = {options.ratio};
        remesh.threads = threads;
        RemeshReport report = remesh_scan(remesh, quiet);
        const double draco = time_draco_encoder(scan, options.directory + "/stock.drc");
        if (repeat == 0 || report.seconds < row.report.seconds) {
          row.report = std::move(report);
        }
        if (draco >= 0.0 && (row.draco_seconds < 0.0 || draco < row.draco_seconds)) {
          row.draco_seconds = draco;
        }
      }
      rows.push_back(std::move(row));
    }
  }
  return rows;
}

std::string throughput_table(const std::vector<ThroughputRow>& rows) {
  std::string text;
  for (const ThroughputRow& row : rows) {
    const RemeshReport& r = row.report;
    const auto n = static_cast<double>(r.input.topology.triangles);
    text += fmt::format(
        "{} triangles -> {} faces ({:.1f} % quads), {} threads: {:.2f} s, {:.0f} triangles/s, "
        "peak {} MiB",
        r.input.topology.triangles, r.output.faces,
        100.0 * static_cast<double>(r.output.quads) /
            std::max(1.0, static_cast<double>(r.output.faces)),
        r.threads, r.seconds, n / r.seconds, r.peak_rss_bytes >> 20U);
    text += row.draco_seconds > 0.0 ? fmt::format(", {:.2f} times draco_encoder ({:.2f} s)\n",
                                                  r.seconds / row.draco_seconds, row.draco_seconds)
                                    : std::string(", draco_encoder not found\n");
    for (const StageRecord& s : r.stages) {
      text += fmt::format(
          "  {:<16}{:>8.3f} s {:>5.1f} %  {:>8.3f} cpu s  {:>12.0f} triangles/s  {} passes\n",
          s.name, s.seconds, 100.0 * s.seconds / r.seconds, s.cpu_seconds,
          n / std::max(1e-9, s.seconds), s.passes);
    }
  }
  return text;
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
    const auto n = static_cast<double>(row.report.input.topology.triangles);
    const std::string base =
        fmt::format("remesh/triangles:{}/threads:{}", row.triangles, row.report.threads);
    double cpu = 0.0;
    for (const StageRecord& s : row.report.stages) {
      add(base + "/stage:" + s.name, s.seconds, s.cpu_seconds, n);
      cpu += s.cpu_seconds;
    }
    add(base, row.report.seconds, cpu, n);
    if (row.draco_seconds > 0.0) {
      add(fmt::format("draco_encoder/triangles:{}", row.triangles), row.draco_seconds,
          row.draco_seconds, n);
    }
  }
  return j.dump(2) + "\n";
}

}  // namespace rattan
