// SPDX-License-Identifier: MIT

// Operator application in the solver: what most of "field" and "parameterize" is. Bytes are those
// that one application has to touch, each once.

#include <numeric>
#include <span>
#include <vector>

#include <benchmark/benchmark.h>

#include "engine/param/periodic_energy.h"
#include "engine/solve/passes.h"
#include "tools/bench/kernels/workload.h"

namespace rattan {

namespace {

/// One tile's system with the values that it is applied to.
template <class Block>
struct OpenTile {
  TileSystem<Block> system;
  std::vector<NodeTerm<Block>> terms;
  std::vector<Value<Block>> x;  ///< owned, then halo
};

template <class Block>
class OpenSystem {
 public:
  OpenSystem(const SystemFields<Block>& fields, float penalty) {
    Workload& w = workload();
    coarsen_system(system_, w.store, fields, *w.field.hierarchy, 1.0F, w.tasks);
    SystemLevel<Block>& finest = system_.levels.front();
    tiles.resize(w.mesh.layout.tile_count());
    for (std::uint32_t t = 0; t < tiles.size(); ++t) {
      OpenTile<Block>& tile = tiles[t];
      tile.system.load(finest, TileId(t));
      tile.terms = tile.system.terms(penalty);
      tile.x = read_local(w.store, fields.solution, fields::kMeshHalo, TileId(t));
      rows += tile.system.extent.owned;
      half_edges += tile.system.neighbor.size();
      halo += tile.system.extent.halo;
    }
  }

  std::uint64_t bytes() const {
    return half_edges * (sizeof(Coefficient<Block>) + sizeof(std::uint32_t)) +
           rows * (sizeof(NodeTerm<Block>) + sizeof(std::uint32_t) + 2 * sizeof(Value<Block>)) +
           halo * sizeof(Value<Block>);
  }

  std::vector<OpenTile<Block>> tiles;
  std::uint64_t rows = 0;
  std::uint64_t half_edges = 0;
  std::uint64_t halo = 0;

 private:
  SystemHierarchy<Block> system_;
};

template <class Block>
void count(benchmark::State& state, const OpenSystem<Block>& open) {
  const auto n = static_cast<std::int64_t>(state.iterations());
  state.SetItemsProcessed(n * static_cast<std::int64_t>(open.rows));
  state.SetBytesProcessed(n * static_cast<std::int64_t>(open.bytes()));
  state.counters["half_edges_per_second"] = benchmark::Counter(
      static_cast<double>(n) * static_cast<double>(open.half_edges), benchmark::Counter::kIsRate);
  state.SetLabel("vertices");
}

/// The curl system's solution is used up, so it starts from zero; the others from what they have.
template <class Block>
OpenSystem<Block> open_system(const SystemFields<Block>& fields, float penalty) {
  Workload& w = workload();
  if (!w.store.has_chunk(fields.solution.name, kBoardTile)) {
    for (std::uint32_t t = 0; t < w.mesh.layout.tile_count(); ++t) {
      write(w.store, fields.solution, TileId(t),
            std::vector<Value<Block>>(w.mesh.layout.tiles[t].owned));
    }
    write(w.store, fields.solution, kBoardTile,
          std::vector<Value<Block>>(w.mesh.layout.border_count));
  }
  return OpenSystem<Block>(fields, penalty);
}

/// One Gauss-Seidel sweep of every tile.
template <class Block>
void sweep_tiles(benchmark::State& state, const SystemFields<Block>& fields, float penalty,
                 SweepMode mode) {
  OpenSystem<Block> open = open_system(fields, penalty);
  for (auto _ : state) {
    for (OpenTile<Block>& tile : open.tiles) {
      sweep<Block>(tile.terms, tile.system.row_begin.span(), tile.system.neighbor.span(),
                   tile.system.coefficient.span(), tile.x, 1.0F, mode);
    }
    benchmark::ClobberMemory();
  }
  count(state, open);
}

/// C x in double precision, as energies and gradients take it.
template <class Block>
void row_products(benchmark::State& state, const SystemFields<Block>& fields) {
  const OpenSystem<Block> open = open_system(fields, 0.0F);
  for (auto _ : state) {
    double sum = 0.0;
    for (const OpenTile<Block>& tile : open.tiles) {
      for (std::uint32_t i = 0; i < tile.system.extent.owned; ++i) {
        const auto product = row_product<Block>(tile.system, i, tile.x);
        sum = std::accumulate(product.begin(), product.end(), sum);
      }
    }
    benchmark::DoNotOptimize(sum);
  }
  count(state, open);
}

void sweep_smoothing(benchmark::State& state) {
  sweep_tiles(state, fields::kSmoothingSystem, 0.1F, SweepMode::kPenalty);
}
void sweep_curl(benchmark::State& state) {
  sweep_tiles(state, fields::kCurlSystem, 0.0F, SweepMode::kLinear);
}
void sweep_phase(benchmark::State& state) {
  sweep_tiles(state, fields::kPhaseSystem, 0.2F, SweepMode::kPenalty);
}
void sweep_phase_unit(benchmark::State& state) {
  sweep_tiles(state, fields::kPhaseSystem, 0.2F, SweepMode::kUnit);
}
void product_smoothing(benchmark::State& state) {
  row_products(state, fields::kSmoothingSystem);
}
void product_curl(benchmark::State& state) {
  row_products(state, fields::kCurlSystem);
}
void product_phase(benchmark::State& state) {
  row_products(state, fields::kPhaseSystem);
}

BENCHMARK(sweep_smoothing)->Name("solve/sweep/smoothing")->Unit(benchmark::kMillisecond);
BENCHMARK(sweep_curl)->Name("solve/sweep/curl")->Unit(benchmark::kMillisecond);
BENCHMARK(sweep_phase)->Name("solve/sweep/phase")->Unit(benchmark::kMillisecond);
BENCHMARK(sweep_phase_unit)->Name("solve/sweep/phase_unit")->Unit(benchmark::kMillisecond);
BENCHMARK(product_smoothing)->Name("solve/product/smoothing")->Unit(benchmark::kMillisecond);
BENCHMARK(product_curl)->Name("solve/product/curl")->Unit(benchmark::kMillisecond);
BENCHMARK(product_phase)->Name("solve/product/phase")->Unit(benchmark::kMillisecond);

}  // namespace

}  // namespace rattan
