// SPDX-License-Identifier: MIT
#include "engine/param/periodic_energy.h"

#include <vector>

#include "engine/mesh/halo_view.h"

namespace rattan {

namespace {

struct State {
  FanView fans;
  HaloView<VertexFrame> frames;
  ChunkView<std::uint64_t> halo_ids;
  ChunkView<float> weight;
  std::vector<PairBlock::Coefficient> coefficient;
};

void assemble_tile(State& s, std::uint64_t first, double omega) {
  const std::vector<VertexFrame> frames = s.frames.gather();
  const std::uint32_t owned = s.fans.owned();
  const std::uint32_t* row = s.fans.row_begin.span().data();
  const std::uint32_t* neighbor = s.fans.neighbor.span().data();
  s.coefficient.resize(s.fans.neighbor.size());
  for (std::uint32_t i = 0; i < owned; ++i) {
    for (std::uint32_t k = row[i]; k < row[i + 1]; ++k) {
      const std::uint32_t j = neighbor[k];
      if (j >= owned) {
        // The gauge is computed from the lower global id to the higher, whoever asks.
        const bool upward = s.halo_ids[j - owned] > first;
        const PairBlock::Coefficient c =
            upward
                ? pair_coefficient(edge_gauge(frames[i], frames[j], omega), s.weight[k])
                : adjoint(pair_coefficient(edge_gauge(frames[j], frames[i], omega), s.weight[k]));
        s.coefficient[k] = c;
      } else if (j > i) {
        const PairBlock::Coefficient c =
            pair_coefficient(edge_gauge(frames[i], frames[j], omega), s.weight[k]);
        s.coefficient[k] = c;
        std::uint32_t back = row[j];
        while (neighbor[back] != i) {
          ++back;
        }
        s.coefficient[back] = adjoint(c);
      }
    }
  }
}

}  // namespace

PairBlock::Coefficient pair_coefficient(const EdgeGauge& gauge, float weight) {
  const auto w = static_cast<double>(weight);
  const exact::SinCos a = exact::sincos(gauge.delta);
  const exact::SinCos b = exact::sincos(gauge.delta_perp);
  return {Complex(static_cast<float>(w * a.cos), static_cast<float>(-w * a.sin)),
          Complex(static_cast<float>(w * b.cos), static_cast<float>(-w * b.sin)), gauge.r};
}

void assemble_phase(Store& store, const ScanMesh& mesh, double omega, TaskGraph& tasks) {
  run_pass<State>(
      tasks, "phase", mesh.layout.tile_count(),
      [&](TileId id, State& s) {
        s.fans.load(store, id);
        s.frames.load(store, fields::kFrame, fields::kMeshHalo, id);
        s.halo_ids = read(store, fields::kMeshHalo.halo_ids, id);
        s.weight = read(store, fields::kEdgeWeight, id);
      },
      [&](TileId id, State& s) { assemble_tile(s, mesh.layout.tiles[id.value].first, omega); },
      [&](TileId id, State& s) {
        write(store, fields::kPhaseSystem.coefficient, id, s.coefficient);
      });
}

}  // namespace rattan
