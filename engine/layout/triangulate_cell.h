// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/types.h"

namespace rattan::layout {

/// Triangles of a small polygon (counter-clockwise in the plane, convex but for rounding, perhaps
/// with corners on straight lines) whose worst is the best possible, by dynamic programming in the
/// cube of its corners. Appends corner numbers to `out`, polygon order kept; keeps its scratch.
class CellTriangulator {
 public:
  void triangulate(std::span<const Vec2d> polygon, std::vector<std::array<std::uint32_t, 3>>& out);

 private:
  void emit(std::uint32_t i, std::uint32_t j, std::vector<std::array<std::uint32_t, 3>>& out) const;
  std::uint32_t n_ = 0;
  std::vector<double> worst_;
  std::vector<std::uint32_t> apex_;
};

}  // namespace rattan::layout
