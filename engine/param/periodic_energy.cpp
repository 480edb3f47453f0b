// SPDX-License-Identifier: MIT
#include "engine/param/periodic_energy.h"

#include <array>
#include <span>
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
  BorderGauges<PairBlock>::Tile gauges;
};

void load_state(Store& store, TileId id, const BorderGauges<PairBlock>* gauges, State& s) {
  if (gauges != nullptr) {
    gauges->load(id, s.gauges);
  }
  s.fans.load(store, id);
  s.frames.load(store, fields::kFrame, fields::kMeshHalo, id);
  s.halo_ids = read(store, fields::kMeshHalo.halo_ids, id);
  s.weight = read(store, fields::kEdgeWeight, id);
}

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
        s.coefficient[find_neighbor(s.fans.neighbor.span(), row[j], i)] = adjoint(c);
      }
    }
  }
  BorderGauges<PairBlock>::compute(s.fans.row_begin.span(), s.fans.neighbor.span(), s.coefficient,
                                   s.gauges);
}

void commit_gauges(BorderGauges<PairBlock>* gauges, TileId id, const State& s) {
  if (gauges != nullptr) {
    gauges->commit(id, s.gauges);
  }
}

/// The pull of a pin against the sum of a vertex' edge weights.
constexpr float kPin = 4.0F;

struct PinnedRows {
  std::vector<std::uint32_t> row_begin{0};
  std::vector<std::uint32_t> neighbor;
  std::vector<PairBlock::Coefficient> coefficient;
  std::vector<std::array<float, 2>> diagonal;
};

/// p Im(U)^2 = p / 2 |U|^2 - p / 2 <U, conj U>. The conjugate is an edge to oneself with half a
/// turn; a plain one of the same weight, and as much on the diagonal, make the sweeps' use of the
/// old value a descent, as on coarse levels.
PinnedRows pin_rows(const State& s, std::span<const VertexFrame> frames,
                    std::span<const float> diagonal) {
  PinnedRows rows;
  const std::uint32_t owned = s.fans.owned();
  const std::span<const std::uint32_t> row = s.fans.row_begin.span();
  const std::span<const std::uint32_t> neighbor = s.fans.neighbor.span();
  rows.row_begin.reserve(owned + 1);
  rows.neighbor.reserve(neighbor.size() + 64);
  rows.coefficient.reserve(neighbor.size() + 64);
  rows.diagonal.assign(owned, {0.0F, 0.0F});
  for (std::uint32_t i = 0; i < owned; ++i) {
    for (std::uint32_t k = row[i]; k < row[i + 1]; ++k) {
      rows.neighbor.push_back(neighbor[k]);
      rows.coefficient.push_back(s.coefficient[k]);
    }
    const std::uint32_t pins = frames[i].pins;
    if (pins != 0) {
      const float p = kPin * diagonal[i];
      const Complex a((pins & kPinTheta) != 0 ? 0.5F * p : 0.0F, 0.0F);
      const Complex b((pins & kPinPhi) != 0 ? 0.5F * p : 0.0F, 0.0F);
      rows.neighbor.insert(rows.neighbor.end(), {i, i});
      rows.coefficient.push_back({a, b, 2});
      rows.coefficient.push_back({a, b, 0});
      rows.diagonal[i] = {2.0F * a.real(), 2.0F * b.real()};
    }
    rows.row_begin.push_back(static_cast<std::uint32_t>(rows.neighbor.size()));
  }
  return rows;
}

}  // namespace

PairBlock::Coefficient pair_coefficient(const EdgeGauge& gauge, float weight) {
  const auto w = static_cast<double>(weight);
  const exact::SinCos a = exact::sincos(gauge.delta);
  const exact::SinCos b = exact::sincos(gauge.delta_perp);
  return {Complex(static_cast<float>(w * a.cos), static_cast<float>(-w * a.sin)),
          Complex(static_cast<float>(w * b.cos), static_cast<float>(-w * b.sin)), gauge.r};
}

double pin_energy(std::uint32_t pins, int density, float diagonal, const PairValue& x) {
  const double p = static_cast<double>(kPin * diagonal);
  const auto of = [&](const Complex& z) {
    const double im = z.imag();
    const double off = density % 2 == 1 ? z.real() - 1.0 : 0.0;
    return p * (off * off + im * im);
  };
  return ((pins & kPinTheta) != 0 ? of(x.u) : 0.0) + ((pins & kPinPhi) != 0 ? of(x.v) : 0.0);
}

void assemble_pulled_phase(Store& store, const ScanMesh& mesh, double omega, TaskGraph& tasks,
                           BorderGauges<PairBlock>* gauges) {
  struct PulledState {
    State plain;
    ChunkView<float> diagonal;
    std::vector<PairValue> rhs;
    std::vector<std::array<float, 2>> pull;
  };
  const SystemFields<PairBlock>& system = fields::kPulledPhaseSystem;
  run_pass<PulledState>(
      tasks, "phase", mesh.layout.tile_count(),
      [&](TileId id, PulledState& s) {
        load_state(store, id, gauges, s.plain);
        s.diagonal = read(store, fields::kDiagonal, id);
      },
      [&](TileId id, PulledState& s) {
        assemble_tile(s.plain, mesh.layout.tiles[id.value].first, omega);
        const auto frames = s.plain.frames.owned.span();
        s.rhs.assign(frames.size(), {Complex(0.0F, 0.0F), Complex(0.0F, 0.0F)});
        s.pull.assign(frames.size(), {0.0F, 0.0F});
        for (std::size_t i = 0; i < frames.size(); ++i) {
          const float p = kPin * s.diagonal[i];
          s.pull[i] = {(frames[i].pins & kPinTheta) != 0 ? p : 0.0F,
                       (frames[i].pins & kPinPhi) != 0 ? p : 0.0F};
          s.rhs[i] = {Complex(s.pull[i][0], 0.0F), Complex(s.pull[i][1], 0.0F)};
        }
      },
      [&](TileId id, PulledState& s) {
        commit_gauges(gauges, id, s.plain);
        write(store, system.coefficient, id, s.plain.coefficient);
        write(store, system.rhs, id, s.rhs);
        write(store, system.part_diagonal, id, s.pull);
      });
}

void assemble_pinned_phase(Store& store, const ScanMesh& mesh, double omega, TaskGraph& tasks,
                           BorderGauges<PairBlock>* gauges) {
  struct PinnedState {
    State plain;
    ChunkView<float> diagonal;
    PinnedRows rows;
  };
  const SystemFields<PairBlock>& system = fields::kPinnedPhaseSystem;
  run_pass<PinnedState>(
      tasks, "phase", mesh.layout.tile_count(),
      [&](TileId id, PinnedState& s) {
        load_state(store, id, gauges, s.plain);
        s.diagonal = read(store, fields::kDiagonal, id);
      },
      [&](TileId id, PinnedState& s) {
        assemble_tile(s.plain, mesh.layout.tiles[id.value].first, omega);
        s.rows = pin_rows(s.plain, s.plain.frames.owned.span(), s.diagonal.span());
      },
      [&](TileId id, PinnedState& s) {
        commit_gauges(gauges, id, s.plain);
        write(store, system.row_begin, id, s.rows.row_begin);
        write(store, system.neighbor, id, s.rows.neighbor);
        write(store, system.coefficient, id, s.rows.coefficient);
        write(store, system.part_diagonal, id, s.rows.diagonal);
      });
}

void assemble_phase(Store& store, const ScanMesh& mesh, double omega, TaskGraph& tasks,
                    BorderGauges<PairBlock>* gauges) {
  run_pass<State>(
      tasks, "phase", mesh.layout.tile_count(),
      [&](TileId id, State& s) { load_state(store, id, gauges, s); },
      [&](TileId id, State& s) { assemble_tile(s, mesh.layout.tiles[id.value].first, omega); },
      [&](TileId id, State& s) {
        commit_gauges(gauges, id, s);
        write(store, fields::kPhaseSystem.coefficient, id, s.coefficient);
      });
}

}  // namespace rattan
