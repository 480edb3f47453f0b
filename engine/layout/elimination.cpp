// SPDX-License-Identifier: MIT
#include "engine/layout/elimination.h"

#include <algorithm>

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>

namespace rattan::layout {

Elimination::Elimination(std::span<const std::uint32_t> begin,
                         std::span<const std::uint32_t> neighbour) {
  const std::size_t n = begin.size() - 1;
  position_.resize(n);
  fixed_weight_.assign(n, 0.0);
  fixed_sum_.assign(n, Vec2d::Zero());
  found_.resize(n);
  sum_.resize(n);
  {
    std::vector<Eigen::Triplet<double, int>> entries;
    entries.reserve(neighbour.size() + n);
    for (std::size_t i = 0; i < n; ++i) {
      entries.emplace_back(static_cast<int>(i), static_cast<int>(i), 1.0);
      for (std::uint32_t e = begin[i]; e < begin[i + 1]; ++e) {
        entries.emplace_back(static_cast<int>(i), static_cast<int>(neighbour[e]), 1.0);
      }
    }
    Eigen::SparseMatrix<double> pattern(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n));
    pattern.setFromTriplets(entries.begin(), entries.end());
    Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
    Eigen::AMDOrdering<int>()(pattern, order);
    for (std::size_t k = 0; k < n; ++k) {
      position_[static_cast<std::size_t>(order.indices()[static_cast<Eigen::Index>(k)])] =
          static_cast<std::uint32_t>(k);
    }
  }
  std::vector<std::uint32_t> unknown(n);
  for (std::uint32_t i = 0; i < n; ++i) {
    unknown[position_[i]] = i;
  }
  // Whoever is joined to one passes it on to the first of these that goes later.
  std::vector<std::uint32_t> first_child(n, ~0U);
  std::vector<std::uint32_t> next_child(n, ~0U);
  later_begin_.assign(1, 0);
  for (std::uint32_t k = 0; k < n; ++k) {
    const std::size_t start = later_.size();
    for (std::uint32_t e = begin[unknown[k]]; e < begin[unknown[k] + 1]; ++e) {
      if (position_[neighbour[e]] > k) {
        later_.push_back(position_[neighbour[e]]);
      }
    }
    for (std::uint32_t c = first_child[k]; c != ~0U; c = next_child[c]) {
      for (std::uint32_t e = later_begin_[c] + 1; e < later_begin_[c + 1]; ++e) {
        const std::uint32_t joined = later_[e];
        later_.push_back(joined);
      }
    }
    const auto from = later_.begin() + static_cast<std::ptrdiff_t>(start);
    std::sort(from, later_.end());
    later_.erase(std::unique(from, later_.end()), later_.end());
    later_begin_.push_back(static_cast<std::uint32_t>(later_.size()));
    if (later_.size() > start) {
      const std::uint32_t parent = later_[start];
      next_child[k] = first_child[parent];
      first_child[parent] = k;
    }
  }
  values_.assign(2 * later_.size(), 0.0);
  place_.resize(neighbour.size());
  for (std::size_t i = 0; i < n; ++i) {
    for (std::uint32_t e = begin[i]; e < begin[i + 1]; ++e) {
      const auto [low, high] = std::minmax(position_[i], position_[neighbour[e]]);
      const auto first = later_.begin() + later_begin_[low];
      const auto at = std::lower_bound(first, later_.begin() + later_begin_[low + 1], high);
      place_[e] =
          static_cast<std::uint32_t>(2 * (at - later_.begin())) + (low == position_[i] ? 0U : 1U);
    }
  }
}

bool Elimination::solve(std::span<Vec2d> x) {
  const std::size_t n = position_.size();
  for (std::size_t k = 0; k < n; ++k) {
    const std::uint32_t begin = later_begin_[k];
    const std::uint32_t end = later_begin_[k + 1];
    double sum = fixed_weight_[k];
    for (std::uint32_t e = begin; e < end; ++e) {
      sum += values_[2 * e];
    }
    if (!(sum > 0)) {
      return false;
    }
    sum_[k] = sum;
    for (std::uint32_t e = begin; e < end; ++e) {
      const std::uint32_t i = later_[e];
      const double for_i = values_[2 * e + 1] / sum;  // what i gets of k's dependences
      const double of_i = values_[2 * e] / sum;
      fixed_weight_[i] += for_i * fixed_weight_[k];
      fixed_sum_[i] += for_i * fixed_sum_[k];
      std::uint32_t at = later_begin_[i];
      for (std::uint32_t f = e + 1; f < end; ++f) {
        const std::uint32_t j = later_[f];
        while (later_[at] != j) {
          ++at;
        }
        values_[2 * at] += for_i * values_[2 * f];
        values_[2 * at + 1] += values_[2 * f + 1] * of_i;
      }
    }
  }
  for (std::size_t k = n; k-- > 0;) {
    Vec2d total = fixed_sum_[k];
    for (std::uint32_t e = later_begin_[k]; e < later_begin_[k + 1]; ++e) {
      total += values_[2 * e] * found_[later_[e]];
    }
    found_[k] = total / sum_[k];
  }
  for (std::size_t i = 0; i < n; ++i) {
    x[i] = found_[position_[i]];
  }
  return true;
}

}  // namespace rattan::layout
