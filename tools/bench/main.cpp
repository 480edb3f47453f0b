// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <unistd.h>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "engine/core/errors.h"
#include "io/file/atomic_file.h"
#include "jobs/version.h"
#include "tools/bench/compare.h"
#include "tools/bench/throughput.h"
#include "tools/manual/manual.h"
#include "tools/rattan/exit_code.h"

namespace rattan {

namespace {

struct Arguments {
  std::vector<std::string> sizes = {"0.1M", "0.4M", "1.6M"};
  ThroughputOptions options;
  std::string json;
  std::string before;
  std::string now;
  double tolerance = 0.1;
};

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

/// A folder of this process's own that goes with it, unless one was named.
class ScanFolder {
 public:
  explicit ScanFolder(std::string& directory) : directory_(directory), own_(directory.empty()) {
    if (own_) {
      directory_ =
          (std::filesystem::temp_directory_path() / ("rattan-bench." + std::to_string(getpid())))
              .string();
    }
  }
  ~ScanFolder() {
    if (own_) {
      std::error_code ignored;
      std::filesystem::remove_all(directory_, ignored);
    }
  }
  ScanFolder(const ScanFolder&) = delete;
  ScanFolder& operator=(const ScanFolder&) = delete;

 private:
  std::string& directory_;
  bool own_;
};

int run(Arguments& args) {
  using Json = nlohmann::ordered_json;
  if (args.before.empty() && !args.now.empty()) {
    throw UsageError("--new needs --compare OLD.json.");
  }
  const Json before = args.before.empty() ? Json() : read_benchmarks(args.before);
  if (!args.now.empty()) {
    std::fputs(compare_benchmarks(before, read_benchmarks(args.now), args.tolerance).c_str(),
               stdout);
    return kExitDone;
  }
  ThroughputOptions& options = args.options;
  for (const std::string& size : args.sizes) {
    options.sizes.push_back(parse_size(size));
  }
  options.rattan = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "rattan";
  const ScanFolder folder(options.directory);
  const Throughput measured = measure_throughput(options);
  const Json document = benchmark_json(throughput_figures(measured));
  if (!args.json.empty()) {
    AtomicFile file(args.json);
    file.write(document.dump(2, ' ', false, Json::error_handler_t::replace) + '\n');
    file.commit();
  }
  std::fputs((describe_context(document) + "\n" + throughput_table(measured)).c_str(), stdout);
  if (!args.before.empty()) {
    std::fputs(("\n" + compare_benchmarks(before, document, args.tolerance)).c_str(), stdout);
  }
  return kExitDone;
}

int bench(int argc, char** argv) {
  CLI::App app{"Measures Rattan's throughput on synthesised scans, beside draco_encoder."};
  app.name("rattan-bench");
  add_help(app, version(), "");
  app.set_version_flag("--version", std::string("rattan-bench ") + version(), "print the version");
  Arguments args;
  ThroughputOptions& options = args.options;
  app.add_option("--sizes", args.sizes, "triangles, e.g. 0.1M,0.4M,1.6M")
      ->delimiter(',')
      ->type_name("N,...")
      ->capture_default_str();
  app.add_option("--threads", options.threads, "thread counts, 0 for all processors")
      ->delimiter(',')
      ->type_name("N,...")
      ->check(CLI::Range(0, 4096).description(""));
  app.add_option("--memory", options.budgets, "budgets, e.g. default,256MiB,2GiB")
      ->delimiter(',')
      ->type_name("SIZE,...");
  app.add_option("--batch", options.batch, "also this many scans of each size by rattan batch")
      ->type_name("N")
      ->check(CLI::Range(0, 100000).description(""));
  app.add_option("--ratio", options.ratio, "faces per triangle")
      ->type_name("R")
      ->capture_default_str();
  app.add_option("--repeats", options.repeats, "runs of each; the median counts")
      ->type_name("N")
      ->check(CLI::Range(1, 1000).description(""))
      ->capture_default_str();
  app.add_option("--directory", options.directory, "where scans are kept between runs")
      ->type_name("DIR");
  app.add_option("--json", args.json, "also write Google Benchmark's JSON")->type_name("FILE");
  app.add_option("--compare", args.before, "JSON of an earlier run to compare with")
      ->type_name("OLD.json");
  app.add_option("--new", args.now, "compare OLD.json with this instead of measuring")
      ->type_name("NEW.json");
  app.add_option("--tolerance", args.tolerance, "growth that is called worse")
      ->type_name("R")
      ->check(CLI::Range(0.0, 100.0).description(""))
      ->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) {
      return app.exit(e);  // --help and --version
    }
    throw UsageError(std::string(e.what()) + ". See rattan-bench --help.");
  }
  return run(args);
}

}  // namespace

}  // namespace rattan

int main(int argc, char** argv) {
  return rattan::run_guarded([&] { return rattan::bench(argc, argv); },
                             [](const std::string& sentence, int /*code*/) {
                               std::fprintf(stderr, "rattan-bench: %s\n", sentence.c_str());
                             });
}
