// SPDX-License-Identifier: MIT
#pragma once

// The periodic energy (PGP 2.4, Appendix B) as a system of the solver: on every edge
// w_ij |X_i - T_ij X_j|^2, T_ij from the edge's quarter turns and phase differences.

#include "engine/core/task_graph.h"
#include "engine/mesh/vertex_graph.h"
#include "engine/param/phase_fields.h"
#include "engine/solve/border_gauges.h"

namespace rattan {

namespace fields {
inline constexpr SystemFields<PairBlock> kPhaseSystem{
    kRowBegin, kNeighbor, {"param/coefficient"}, kDiagonal, {}, {}, kPhase};
/// With feature curves and an odd number of lines a period: pinned vertices (VertexFrame::pins) are
/// pulled to a line.
inline constexpr SystemFields<PairBlock> kPulledPhaseSystem{
    kRowBegin,      kNeighbor, {"param/coefficient"}, kDiagonal, {},
    {"param/pull"}, kPhase,    {"param/pin"}};
/// With an even number: rows of pinned vertices have edges to themselves.
inline constexpr SystemFields<PairBlock> kPinnedPhaseSystem{
    {"param/row_begin"}, {"param/neighbor"}, {"param/coefficient"}, kDiagonal, {}, {}, kPhase,
    {"param/pin"}};
}  // namespace fields

/// C_ij = w T_ij from the edge's gauge along i -> j.
PairBlock::Coefficient pair_coefficient(const EdgeGauge& gauge, float weight);

/// The coefficient of j -> i: the adjoint of that of i -> j, to the last bit.
inline PairBlock::Coefficient adjoint(const PairBlock::Coefficient& c) {
  switch (c.r) {
    case 0:
      return {std::conj(c.a), std::conj(c.b), 0};
    case 1:
      return {c.b, std::conj(c.a), 3};
    case 2:
      return {c.a, c.b, 2};
    default:
      return {std::conj(c.b), c.a, 1};
  }
}

/// C x: turn, then multiply.
inline PairValue apply(const PairBlock::Coefficient& c, const PairValue& x) {
  const PairValue t = quarter_turn(x, c.r);
  return {c.a * t.u, c.b * t.v};
}

/// One pass: writes the coefficients of kPhaseSystem (no fit, no rhs) from kFrame and the graph.
/// `omega`: the period, a length.
void assemble_phase(Store& store, const ScanMesh& mesh, double omega, TaskGraph& tasks,
                    BorderGauges<PairBlock>* gauges = nullptr);

/// The same for kPulledPhaseSystem: adds p |U - 1|^2 for every U pinned, likewise for V, which
/// holds their angles at 0.
void assemble_pulled_phase(Store& store, const ScanMesh& mesh, double omega, TaskGraph& tasks,
                           BorderGauges<PairBlock>* gauges = nullptr);

/// The same for kPinnedPhaseSystem: adds p Im(U)^2 for every U pinned, likewise for V, which holds
/// their angles at 0 or pi: on lines, if their number a period is even.
void assemble_pinned_phase(Store& store, const ScanMesh& mesh, double omega, TaskGraph& tasks,
                           BorderGauges<PairBlock>* gauges = nullptr);

/// The energy that pins hold at a vertex of such weights: p |U - 1|^2 or p Im(U)^2 for every U
/// pinned, likewise for V. `density`: lines a period. 0 where nothing is pinned.
double pin_energy(std::uint32_t pins, int density, float diagonal, const PairValue& x);

}  // namespace rattan
