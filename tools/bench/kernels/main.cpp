// SPDX-License-Identifier: MIT

// Micro-benchmarks of the kernels, one thread. Options are Google Benchmark's, and --triangles=N.

#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include <benchmark/benchmark.h>
#include <nlohmann/json.hpp>
#include <oneapi/tbb/global_control.h>

#include "tools/bench/figures.h"
#include "tools/bench/kernels/workload.h"
#include "tools/rattan/exit_code.h"

namespace {

constexpr std::string_view kTriangles = "--triangles=";

int run(int argc, char** argv) {
  std::vector<char*> rest;
  for (int i = 0; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word.substr(0, kTriangles.size()) == kTriangles) {
      const std::uint64_t triangles = std::strtoull(argv[i] + kTriangles.size(), nullptr, 10);
      if (triangles < 1000) {
        std::fputs("rattan-bench-kernels: --triangles takes 1000 or more.\n", stderr);
        return rattan::kExitUsage;
      }
      rattan::set_workload_triangles(triangles);
      benchmark::AddCustomContext("triangles", std::to_string(triangles));
    } else {
      rest.push_back(argv[i]);
    }
  }
  auto left = static_cast<int>(rest.size());
  rest.push_back(nullptr);
  benchmark::Initialize(&left, rest.data());
  if (benchmark::ReportUnrecognizedArguments(left, rest.data())) {
    return rattan::kExitUsage;
  }
  const nlohmann::ordered_json context = rattan::machine_context();
  for (const auto& [name, value] : context.items()) {
    benchmark::AddCustomContext(name, value.is_string() ? value.get<std::string>() : value.dump());
  }
  const oneapi::tbb::global_control one(oneapi::tbb::global_control::max_allowed_parallelism, 1);
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return rattan::kExitDone;
}

}  // namespace

int main(int argc, char** argv) {
  return rattan::run_guarded([&] { return run(argc, argv); },
                             [](const std::string& sentence, int /*code*/) {
                               std::fprintf(stderr, "rattan-bench-kernels: %s\n", sentence.c_str());
                             });
}
