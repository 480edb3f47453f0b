// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <unistd.h>
#include <vector>

#include <CLI/CLI.hpp>

#include "engine/core/errors.h"
#include "jobs/version.h"
#include "tools/bench/throughput.h"
#include "tools/manual/manual.h"
#include "tools/rattan/exit_code.h"

namespace rattan {

namespace {

/// "0.4M" or "100k" or "5000" triangles.
std::uint64_t parse_size(const std::string& text) {
  std::size_t used = 0;
  double value = 0.0;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  const std::string unit = text.substr(used);
  const double factor = unit == "M" ? 1e6 : unit == "k" ? 1e3 : unit.empty() ? 1.0 : 0.0;
  if (used == 0 || factor == 0.0 || !(value * factor >= 12.0)) {
    throw UsageError("--sizes: '" + text + "' is no triangle count; write 5000, 100k or 1.6M.");
  }
  return static_cast<std::uint64_t>(std::llround(value * factor));
}

int run(const std::vector<std::string>& sizes, ThroughputOptions options, const std::string& json) {
  for (const std::string& size : sizes) {
    options.sizes.push_back(parse_size(size));
  }
  options.rattan = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "rattan";
  const bool own_directory = options.directory.empty();
  if (own_directory) {
    options.directory =
        (std::filesystem::temp_directory_path() / ("rattan-bench." + std::to_string(getpid())))
            .string();
  }
  const std::vector<ThroughputRow> rows = measure_throughput(options);
  std::fputs(throughput_table(rows).c_str(), stdout);
  if (!json.empty()) {
    std::ofstream file(json);
    file << throughput_json(rows);
  }
  if (own_directory) {
    std::filesystem::remove_all(options.directory);
  }
  return 0;
}

int bench(int argc, char** argv) {
  CLI::App app{"Measures Rattan's throughput on synthesised scans, beside draco_encoder."};
  app.name("rattan-bench");
  add_help(app, version(), "");
  std::vector<std::string> sizes = {"0.1M", "0.4M", "1.6M"};
  ThroughputOptions options;
  std::string json;
  app.add_option("--sizes", sizes, "triangles, e.g. 0.1M,0.4M,1.6M")
      ->delimiter(',')
      ->type_name("N")
      ->capture_default_str();
  app.add_option("--threads", options.threads, "thread counts, 0 for all processors")
      ->delimiter(',');
  app.add_option("--memory", options.budgets, "budgets, e.g. default,256MiB,2GiB")
      ->delimiter(',')
      ->type_name("SIZE");
  app.add_option("--ratio", options.ratio, "faces per triangle")->capture_default_str();
  app.add_option("--repeats", options.repeats, "runs of each; the fastest counts")
      ->capture_default_str();
  app.add_option("--directory", options.directory, "where scans are kept between runs")
      ->type_name("DIR");
  app.add_option("--json", json, "also write Google Benchmark's JSON")->type_name("FILE");
  CLI11_PARSE(app, argc, argv);
  return run(sizes, options, json);
}

}  // namespace

}  // namespace rattan

int main(int argc, char** argv) {
  return rattan::run_guarded([&] { return rattan::bench(argc, argv); });
}
