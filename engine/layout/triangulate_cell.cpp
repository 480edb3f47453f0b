// SPDX-License-Identifier: MIT
#include "engine/layout/triangulate_cell.h"

#include <algorithm>
#include <limits>

namespace rattan::layout {

namespace {

/// 1 for an equilateral triangle, 0 without area, negative if it is turned over.
double shape(const Vec2d& a, const Vec2d& b, const Vec2d& c) {
  const Vec2d u = b - a;
  const Vec2d v = c - a;
  const double squares = u.squaredNorm() + v.squaredNorm() + (c - b).squaredNorm();
  constexpr double kEquilateral = 3.4641016151377544;  // 2 sqrt 3
  return squares > 0.0 ? kEquilateral * (u.x() * v.y() - u.y() * v.x()) / squares : 0.0;
}

}  // namespace

void CellTriangulator::triangulate(std::span<const Vec2d> polygon,
                                   std::vector<std::array<std::uint32_t, 3>>& out) {
  n_ = static_cast<std::uint32_t>(polygon.size());
  if (n_ == 3) {
    out.push_back({0, 1, 2});
    return;
  }
  worst_.assign(std::size_t{n_} * n_, std::numeric_limits<double>::infinity());
  apex_.assign(std::size_t{n_} * n_, 0);
  for (std::uint32_t length = 2; length < n_; ++length) {
    for (std::uint32_t i = 0; i + length < n_; ++i) {
      const std::uint32_t j = i + length;
      double best = -std::numeric_limits<double>::infinity();
      for (std::uint32_t m = i + 1; m < j; ++m) {
        const double worst = std::min(
            {worst_[i * n_ + m], worst_[m * n_ + j], shape(polygon[i], polygon[m], polygon[j])});
        if (worst > best) {
          best = worst;
          apex_[i * n_ + j] = m;
        }
      }
      worst_[i * n_ + j] = best;
    }
  }
  emit(0, n_ - 1, out);
}

void CellTriangulator::emit(std::uint32_t i, std::uint32_t j,
                            std::vector<std::array<std::uint32_t, 3>>& out) const {
  if (j < i + 2) {
    return;
  }
  const std::uint32_t m = apex_[i * n_ + j];
  emit(i, m, out);
  out.push_back({i, m, j});
  emit(m, j, out);
}

}  // namespace rattan::layout
