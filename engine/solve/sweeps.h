// SPDX-License-Identifier: MIT
#pragma once

// Gauss-Seidel over one tile: each owned node in turn takes the exact minimiser of the energy as a
// function of it alone (over-relaxed by omega); halo values stay. Float arithmetic.

#include <span>

#include "engine/solve/system_level.h"

namespace rattan {

enum class SweepMode {
  kLinear,   ///< (diagonal + eps) x = C x + b; all blocks
  kPenalty,  ///< norm s of each complex part solves D s - |Cx + b| + 2 eps s (s^2 - 1) = 0
  kNewton,   ///< linear, plus the penalty's positive curvature at `at`: per complex part u,
             ///< D + 2 eps max(|u|^2 - 1, 0) + 4 eps u u^T
  kHold,     ///< norms as they are: the direction of C x + b
  kUnit,     ///< unit norms: the direction of C x + b; not over-relaxed
};

/// `x` holds owned then halo values; `at` (kNewton alone) owned values.
template <class Block>
void sweep(std::span<const NodeTerm<Block>> terms, std::span<const std::uint32_t> row_begin,
           std::span<const std::uint32_t> neighbor, std::span<const Coefficient<Block>> coefficient,
           std::span<Value<Block>> x, float omega, SweepMode mode, bool backward = false,
           std::span<const Value<Block>> at = {});

/// `count` sweeps in a row. Of those in kPenalty mode the last, and every third before it, look for
/// norms; the others hold them (kHold), which descends as well and saves most of the divisions.
/// `symmetric`: forward and backward in turn.
template <class Block>
void sweep_often(const TileSystem<Block>& tile, std::span<const NodeTerm<Block>> terms,
                 std::span<Value<Block>> x, float omega, SweepMode mode, int count,
                 bool symmetric = false, std::span<const Value<Block>> at = {}) {
  constexpr int kNormsEvery = 3;
  for (int k = 0; k < count; ++k) {
    const bool hold = mode == SweepMode::kPenalty && (count - 1 - k) % kNormsEvery != 0;
    sweep<Block>(terms, tile.row_begin.span(), tile.neighbor.span(), tile.coefficient.span(), x,
                 omega, hold ? SweepMode::kHold : mode, symmetric && k % 2 == 1, at);
  }
}

/// Part that real k of a value belongs to.
template <class Block>
constexpr std::size_t part_of(std::size_t k) {
  return k * BlockOps<Block>::kParts / BlockOps<Block>::kReals;
}

/// sum_j C_ij x_j in double.
template <class Block>
std::array<double, BlockOps<Block>::kReals> row_product(const TileSystem<Block>& tile,
                                                        std::uint32_t i,
                                                        std::span<const Value<Block>> x) {
  using Ops = BlockOps<Block>;
  std::array<double, Ops::kReals> out{};
  for (std::uint32_t e = tile.row_begin[i]; e < tile.row_begin[i + 1]; ++e) {
    std::array<double, Ops::kReals> xj;
    for (std::size_t k = 0; k < Ops::kReals; ++k) {
      xj[k] = reals<Block>(x[tile.neighbor[e]])[k];
    }
    Ops::apply_add(tile.coefficient[e], xj.data(), out.data());
  }
  return out;
}

/// Adds row i's share of the quadratic energy, without penalty, at `x`.
template <class Block>
void add_row_energy(const TileSystem<Block>& tile, const NodeTerm<Block>& term, std::uint32_t i,
                    std::span<const Value<Block>> x, double& sum) {
  const auto row = row_product<Block>(tile, i, x);
  const float* xi = reals<Block>(x[i]);
  for (std::size_t k = 0; k < BlockOps<Block>::kReals; ++k) {
    const double d = term.diagonal[part_of<Block>(k)];
    sum += xi[k] * (d * xi[k] - row[k] - 2.0 * reals<Block>(term.rhs)[k]);
  }
}

}  // namespace rattan
