// SPDX-License-Identifier: MIT

// Kernels on plain arrays: the order along the Hilbert curve, functions of exact_math, checksums.

#include <cstring>
#include <numeric>
#include <vector>

#include <benchmark/benchmark.h>

#include "engine/core/exact_math.h"
#include "engine/mesh/curve.h"
#include "engine/mesh/radix_sort.h"
#include "io/store/checksum.h"
#include "tools/bench/kernels/workload.h"

namespace rattan {

namespace {

/// What ingest sorts.
struct KeyedVertex {
  std::uint64_t key = 0;
  Vec3f position;
  std::uint32_t id = 0;
};

/// The scan's vertices in an order that has nothing to do with the curve.
std::vector<KeyedVertex> shuffled_vertices() {
  const std::vector<Vec3f>& positions = workload().positions;
  std::vector<KeyedVertex> vertices(positions.size());
  // A step without a common factor with the count visits each once.
  std::size_t step = positions.size() * 5 / 8 + 1;
  while (std::gcd(step, positions.size()) != 1) {
    ++step;
  }
  for (std::size_t i = 0, at = 0; i < vertices.size(); ++i, at = (at + step) % vertices.size()) {
    vertices[i].position = positions[at];
    vertices[i].id = static_cast<std::uint32_t>(at);
  }
  return vertices;
}

void count(benchmark::State& state, const char* what, std::size_t items, std::size_t bytes) {
  const auto n = static_cast<std::int64_t>(state.iterations());
  state.SetItemsProcessed(n * static_cast<std::int64_t>(items));
  state.SetBytesProcessed(n * static_cast<std::int64_t>(bytes));
  state.SetLabel(what);
}

void set_keys(std::vector<KeyedVertex>& vertices) {
  const HilbertCurve curve(workload().mesh.box_min, workload().mesh.box_max);
  for (KeyedVertex& v : vertices) {
    v.key = curve(v.position.cast<double>());
  }
}

void hilbert_keys(benchmark::State& state) {
  std::vector<KeyedVertex> vertices = shuffled_vertices();
  for (auto _ : state) {
    set_keys(vertices);
    benchmark::ClobberMemory();
  }
  count(state, "vertices", vertices.size(), vertices.size() * (sizeof(Vec3f) + 8));
}

/// Bytes: each record read and written once for each of the six digits of a key.
void hilbert_sort(benchmark::State& state) {
  std::vector<KeyedVertex> vertices = shuffled_vertices();
  set_keys(vertices);
  std::vector<KeyedVertex> records;
  std::vector<KeyedVertex> scratch;
  for (auto _ : state) {
    state.PauseTiming();
    records = vertices;
    state.ResumeTiming();
    radix_sort(records, scratch, [](const KeyedVertex& v) { return v.key; });
    benchmark::ClobberMemory();
  }
  count(state, "vertices", vertices.size(), vertices.size() * sizeof(KeyedVertex) * 2 * 6);
}

template <class Function>
void over_numbers(benchmark::State& state, double from, double to, const Function& function) {
  constexpr std::size_t kNumbers = 4096;
  std::vector<double> numbers(kNumbers);
  for (std::size_t i = 0; i < kNumbers; ++i) {
    // No order that a branch predictor could learn.
    const std::size_t at = (i * 2609) % kNumbers;
    numbers[i] = from + (to - from) * (static_cast<double>(at) + 0.5) / kNumbers;
  }
  for (auto _ : state) {
    double sum = 0.0;
    for (const double x : numbers) {
      sum += function(x);
    }
    benchmark::DoNotOptimize(sum);
  }
  count(state, "values", kNumbers, kNumbers * sizeof(double));
}

void sincos(benchmark::State& state) {
  over_numbers(state, -10.0, 10.0, [](double x) {
    const auto [s, c] = exact::sincos(x);
    return s + c;
  });
}
void atan2(benchmark::State& state) {
  over_numbers(state, -1.0, 1.0, [](double x) { return exact::atan2(x, 0.3 - x * x); });
}
void acos(benchmark::State& state) {
  over_numbers(state, -1.0, 1.0, [](double x) { return exact::acos(x); });
}
void exp(benchmark::State& state) {
  over_numbers(state, -20.0, 20.0, [](double x) { return exact::exp(x); });
}
void log(benchmark::State& state) {
  over_numbers(state, 1e-3, 1e3, [](double x) { return exact::log(x); });
}
void pow(benchmark::State& state) {
  over_numbers(state, 1e-3, 1e3, [](double x) { return exact::pow(x, 0.2); });
}

/// The least that touching memory takes, to compare the others with.
void copy(benchmark::State& state) {
  const auto bytes = static_cast<std::size_t>(state.range(0));
  const std::vector<std::byte> from(bytes, std::byte{1});
  std::vector<std::byte> to(bytes);
  for (auto _ : state) {
    std::memcpy(to.data(), from.data(), bytes);
    benchmark::ClobberMemory();
  }
  count(state, "bytes, read and written", bytes, 2 * bytes);
}

void chunk_checksums(benchmark::State& state) {
  const std::vector<std::byte> chunk(std::size_t{1} << 20, std::byte{7});
  for (auto _ : state) {
    benchmark::DoNotOptimize(checksum(chunk));
  }
  count(state, "bytes", chunk.size(), chunk.size());
}

BENCHMARK(hilbert_keys)->Name("ingest/hilbert_keys")->Unit(benchmark::kMillisecond);
BENCHMARK(hilbert_sort)->Name("ingest/hilbert_sort")->Unit(benchmark::kMillisecond);
BENCHMARK(sincos)->Name("exact_math/sincos")->Unit(benchmark::kMicrosecond);
BENCHMARK(atan2)->Name("exact_math/atan2")->Unit(benchmark::kMicrosecond);
BENCHMARK(acos)->Name("exact_math/acos")->Unit(benchmark::kMicrosecond);
BENCHMARK(exp)->Name("exact_math/exp")->Unit(benchmark::kMicrosecond);
BENCHMARK(log)->Name("exact_math/log")->Unit(benchmark::kMicrosecond);
BENCHMARK(pow)->Name("exact_math/pow")->Unit(benchmark::kMicrosecond);
BENCHMARK(chunk_checksums)->Name("store/checksum")->Unit(benchmark::kMicrosecond);
BENCHMARK(copy)->Name("memory/copy")->Arg(1 << 18)->Arg(1 << 26)->Unit(benchmark::kMicrosecond);

}  // namespace

}  // namespace rattan
