// SPDX-License-Identifier: MIT
#pragma once

// Solver for convex combinations: x_i is the mean of its neighbours and of fixed values, with
// positive weights. Elimination without a subtraction (Grassmann, Taksar, Heyman 1985): an unknown
// is taken out by joining its neighbours, so every number keeps its relative precision and each
// result is a convex combination of fixed values, however badly scaled the weights are.

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "engine/core/types.h"

namespace rattan::layout {

class Elimination {
 public:
  Elimination() = default;
  /// `neighbour` [begin[i], begin[i + 1]): the unknowns that i depends on, each once; dependence is
  /// mutual. Orders them for little fill.
  Elimination(std::span<const std::uint32_t> begin, std::span<const std::uint32_t> neighbour);

  /// Sets the weight of an entry of `neighbour`.
  void set_weight(std::size_t entry, double weight) { values_[place_[entry]] = weight; }
  /// The weight of all fixed values that unknown i depends on, and their sum, weighted. To be set,
  /// like all weights, before each solve().
  void set_fixed(std::uint32_t i, double weight, const Vec2d& sum) {
    fixed_weight_[position_[i]] = weight;
    fixed_sum_[position_[i]] = sum;
  }
  /// False if weights are so small that unknowns depend on no fixed value any more.
  bool solve(std::span<Vec2d> x);

  /// Sets all weights between unknowns to 0.
  void clear() { std::fill(values_.begin(), values_.end(), 0.0); }

 private:
  std::vector<std::uint32_t> position_;     ///< one an unknown: when it is eliminated
  std::vector<std::uint32_t> later_begin_;  ///< positions + 1
  std::vector<std::uint32_t> later_;        ///< positions joined to each when it goes, ascending
  /// [2 e]: the weight of later_[e] for its earlier unknown, [2 e + 1]: the other way.
  std::vector<double> values_;
  std::vector<std::uint32_t> place_;
  std::vector<double> fixed_weight_;
  std::vector<Vec2d> fixed_sum_;
  std::vector<Vec2d> found_;
  std::vector<double> sum_;
};

}  // namespace rattan::layout
