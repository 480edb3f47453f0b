// SPDX-License-Identifier: MIT
#include "tools/bench/throughput.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sched.h>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "engine/core/errors.h"
#include "engine/core/progress.h"
#include "io/synth/synth.h"
#include "tools/bench/timed_command.h"

namespace rattan {

namespace {

namespace fs = std::filesystem;

int processors() {
  cpu_set_t set;
  CPU_ZERO(&set);
  return sched_getaffinity(0, sizeof set, &set) == 0 ? std::max(1, CPU_COUNT(&set)) : 1;
}

void synthesise_once(std::uint64_t triangles, std::uint64_t seed, const fs::path& scan) {
  if (!fs::exists(scan)) {
    NullProgress quiet;
    SynthOptions synth;
    synth.triangles = triangles;
    synth.seed = seed;
    synthesise(synth, scan.string(), quiet);
  }
}

/// From the header of a PLY file that synthesise wrote.
std::uint64_t triangles_of(const fs::path& scan) {
  constexpr std::string_view kCount = "element face ";
  std::ifstream file(scan, std::ios::binary);
  for (std::string line; std::getline(file, line) && line != "end_header";) {
    if (line.compare(0, kCount.size(), kCount) == 0) {
      return std::stoull(line.substr(kCount.size()));
    }
  }
  throw InputError(scan.string(), "", "no scan of an earlier benchmark", "Delete it");
}

TimedCommand run_or_throw(const std::vector<std::string>& words) {
  const TimedCommand command = time_command(words);
  if (!command.ok()) {
    throw ResourceError(
        fmt::format("A run failed (exit code {}). Try: {}", command.exit, fmt::join(words, " ")));
  }
  return command;
}

std::vector<std::string> process_options(const ThroughputOptions& options, int threads,
                                         const std::string& budget) {
  std::vector<std::string> words = {"--ratio",   fmt::format("{}", options.ratio),
                                    "--threads", std::to_string(threads),
                                    "--fresh",   "--quiet"};
  if (budget != kDefaultBudget) {
    words.insert(words.end(), {"--memory", budget});
  }
  return words;
}

RemeshRun remesh_once(const ThroughputOptions& options, const std::string& scan,
                      ThroughputRow& row) {
  const std::string report = options.directory + "/report.json";
  std::vector<std::string> words = {
      options.rattan, "remesh", scan, "-o", options.directory + "/remesh.drc", "--report", report};
  for (std::string& word : process_options(options, row.threads, row.budget)) {
    words.push_back(std::move(word));
  }
  const TimedCommand command = run_or_throw(words);
  std::ifstream file(report);
  const auto j = nlohmann::json::parse(file);
  row.triangles = j["input"]["triangles"];
  row.faces = j["output"]["faces"];
  row.quads = j["output"]["quads"];
  RemeshRun run{.seconds = command.seconds,
                .cpu_seconds = command.cpu_seconds,
                .peak_bytes = j["peak_rss_bytes"],
                .stages = {}};
  for (const auto& stage : j["stages"]) {
    StageTime time{.name = stage["name"],
                   .seconds = stage["seconds"],
                   .cpu_seconds = stage["cpu_seconds"],
                   .passes = stage["passes"],
                   .bytes_read = stage["bytes_read"],
                   .bytes_written = stage["bytes_written"],
                   .bytes_moved = stage["bytes_moved"]};
    // Files don't go through the store.
    if (time.name == "ingest") {
      time.bytes_moved += fs::file_size(scan);
    } else if (time.name == "write") {
      time.bytes_moved += j["output"]["bytes"].get<std::uint64_t>();
    }
    // A size that was corrected has stages more than once.
    const auto same = std::find_if(run.stages.begin(), run.stages.end(),
                                   [&](const StageTime& s) { return s.name == time.name; });
    if (same == run.stages.end()) {
      run.stages.push_back(std::move(time));
    } else {
      same->seconds += time.seconds;
      same->cpu_seconds += time.cpu_seconds;
      same->passes += time.passes;
      same->bytes_read += time.bytes_read;
      same->bytes_written += time.bytes_written;
      same->bytes_moved += time.bytes_moved;
    }
  }
  return run;
}

Measure measure_of(const TimedCommand& command, double triangles, double scans) {
  return {command.seconds,
          command.cpu_seconds,
          {{"items_per_second", triangles / command.seconds},
           {"scans_per_second", scans / command.seconds},
           {"cpu_use", command.cpu_seconds / command.seconds}}};
}

void measure_single(const ThroughputOptions& options, std::uint64_t triangles, Throughput& out) {
  const std::string scan = options.directory + fmt::format("/synth_{}.ply", triangles);
  synthesise_once(triangles, SynthOptions{}.seed, scan);
  const std::size_t first = out.rows.size();
  for (const int threads : options.threads) {
    for (const std::string& budget : options.budgets) {
      ThroughputRow row;
      row.size = triangles;
      row.budget = budget;
      row.threads = threads > 0 ? threads : processors();
      out.rows.push_back(std::move(row));
    }
  }
  std::vector<Measure> draco;
  for (int repeat = 0; repeat < options.repeats; ++repeat) {
    for (std::size_t at = first; at < out.rows.size(); ++at) {
      out.rows[at].runs.push_back(remesh_once(options, scan, out.rows[at]));
    }
    const TimedCommand stock =
        time_command({"draco_encoder", "-i", scan, "-o", options.directory + "/stock.drc"});
    if (stock.ok()) {
      draco.push_back(measure_of(stock, static_cast<double>(triangles_of(scan)), 1.0));
    }
  }
  for (std::size_t at = first; at < out.rows.size(); ++at) {
    out.rows[at].draco = draco;
  }
}

TimedCommand batch_once(const ThroughputOptions& options, const fs::path& scans,
                        const BatchRow& row) {
  const fs::path out = fs::path(options.directory) / "batch.out";
  fs::remove_all(out);
  std::vector<std::string> words = {options.rattan, "batch",      scans.string(),
                                    "-o",           out.string(), "--no-report"};
  for (std::string& word : process_options(options, row.threads, row.budget)) {
    words.push_back(std::move(word));
  }
  const TimedCommand command = run_or_throw(words);
  const auto made =
      std::count_if(fs::recursive_directory_iterator(out), fs::recursive_directory_iterator(),
                    [](const fs::directory_entry& entry) {
                      return entry.is_regular_file() && entry.path().extension() == ".drc";
                    });
  if (made != row.scans) {
    throw ResourceError(fmt::format("{} of {} outputs are there after: {}", made, row.scans,
                                    fmt::join(words, " ")));
  }
  fs::remove_all(out);
  return command;
}

/// What somebody without Rattan would type.
TimedCommand draco_loop(const ThroughputOptions& options, const fs::path& scans) {
  const fs::path out = fs::path(options.directory) / "loop.out";
  fs::create_directories(out);
  const std::string loop =
      "for scan in \"$1\"/*.ply; do name=${scan##*/}; "
      "draco_encoder -i \"$scan\" -o \"$2/${name%.ply}.drc\"; done";
  const TimedCommand command =
      time_command({"sh", "-ec", loop, "sh", scans.string(), out.string()});
  fs::remove_all(out);
  return command;
}

void measure_batch(const ThroughputOptions& options, std::uint64_t triangles, Throughput& out) {
  const fs::path scans =
      fs::path(options.directory) / fmt::format("batch_{}x{}", options.batch, triangles);
  fs::create_directories(scans);
  BatchRow row;
  row.size = triangles;
  row.scans = options.batch;
  for (int k = 0; k < options.batch; ++k) {
    const fs::path scan = scans / fmt::format("scan_{:05}.ply", k);
    synthesise_once(triangles, SynthOptions{}.seed + static_cast<std::uint64_t>(k), scan);
    row.triangles += triangles_of(scan);
  }
  const std::size_t first = out.batches.size();
  for (const int threads : options.threads) {
    for (const std::string& budget : options.budgets) {
      row.threads = threads > 0 ? threads : processors();
      row.budget = budget;
      out.batches.push_back(row);
    }
  }
  const auto n = static_cast<double>(row.triangles);
  std::vector<Measure> draco;
  for (int repeat = 0; repeat < options.repeats; ++repeat) {
    for (std::size_t at = first; at < out.batches.size(); ++at) {
      BatchRow& batch = out.batches[at];
      const TimedCommand command = batch_once(options, scans, batch);
      batch.runs.push_back(measure_of(command, n, row.scans));
      batch.peak_bytes.push_back(command.peak_bytes);
    }
    const TimedCommand stock = draco_loop(options, scans);
    if (stock.ok()) {
      draco.push_back(measure_of(stock, n, row.scans));
    }
  }
  for (std::size_t at = first; at < out.batches.size(); ++at) {
    out.batches[at].draco = draco;
  }
}

}  // namespace

double ThroughputRow::seconds() const {
  std::vector<double> values;
  values.reserve(runs.size());
  for (const RemeshRun& run : runs) {
    values.push_back(run.seconds);
  }
  return spread(std::move(values)).median;
}

Throughput measure_throughput(const ThroughputOptions& options) {
  fs::create_directories(options.directory);
  Throughput measured;
  for (const std::uint64_t triangles : options.sizes) {
    measure_single(options, triangles, measured);
    if (options.batch > 0) {
      measure_batch(options, triangles, measured);
    }
  }
  return measured;
}

std::vector<Figure> throughput_figures(const Throughput& measured) {
  std::vector<Figure> figures;
  const auto memory = [](const std::string& budget) {
    return budget == kDefaultBudget ? std::string() : "/memory:" + budget;
  };
  const auto add_draco = [&](std::string name, const std::vector<Measure>& repeats) {
    if (!repeats.empty() && std::none_of(figures.begin(), figures.end(),
                                         [&](const Figure& other) { return other.name == name; })) {
      figures.push_back({std::move(name), 1, repeats});
    }
  };
  // The ratio of each repeat to the stock encoder beside it.
  const auto add_ratio = [](Measure& measure, const std::vector<Measure>& draco, std::size_t k) {
    if (k < draco.size()) {
      measure.counters.emplace_back("times_draco_encoder", measure.seconds / draco[k].seconds);
    }
  };
  for (const ThroughputRow& row : measured.rows) {
    const auto n = static_cast<double>(row.triangles);
    const std::string base =
        fmt::format("remesh/triangles:{}/threads:{}{}", row.size, row.threads, memory(row.budget));
    Figure whole{base, row.threads, {}};
    for (std::size_t k = 0; k < row.runs.size(); ++k) {
      const RemeshRun& run = row.runs[k];
      Measure measure{run.seconds,
                      run.cpu_seconds,
                      {{"items_per_second", n / run.seconds},
                       {"cpu_use", run.cpu_seconds / run.seconds},
                       {"peak_rss_bytes", static_cast<double>(run.peak_bytes)}}};
      add_ratio(measure, row.draco, k);
      whole.repeats.push_back(std::move(measure));
    }
    figures.push_back(std::move(whole));
    for (std::size_t s = 0; s < row.runs[0].stages.size(); ++s) {
      Figure figure{base + "/stage:" + row.runs[0].stages[s].name, row.threads, {}};
      for (const RemeshRun& run : row.runs) {
        const StageTime& t = run.stages.at(s);
        const double seconds = std::max(1e-9, t.seconds);
        figure.repeats.push_back(
            {t.seconds,
             t.cpu_seconds,
             {{"items_per_second", n / seconds},
              {"bytes_per_second", static_cast<double>(t.bytes_moved) / seconds},
              {"share", t.seconds / run.seconds},
              {"passes", static_cast<double>(t.passes)},
              {"disk_bytes_read", static_cast<double>(t.bytes_read)},
              {"disk_bytes_written", static_cast<double>(t.bytes_written)}}});
      }
      figures.push_back(std::move(figure));
    }
    add_draco(fmt::format("draco_encoder/triangles:{}", row.size), row.draco);
  }
  for (const BatchRow& row : measured.batches) {
    Figure figure{fmt::format("batch/scans:{}/triangles:{}/threads:{}{}", row.scans, row.size,
                              row.threads, memory(row.budget)),
                  row.threads, row.runs};
    for (std::size_t k = 0; k < row.runs.size(); ++k) {
      figure.repeats[k].counters.emplace_back("peak_rss_bytes",
                                              static_cast<double>(row.peak_bytes[k]));
      add_ratio(figure.repeats[k], row.draco, k);
    }
    figures.push_back(std::move(figure));
    add_draco(fmt::format("draco_encoder_loop/scans:{}/triangles:{}", row.scans, row.size),
              row.draco);
  }
  return figures;
}

}  // namespace rattan
