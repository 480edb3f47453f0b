// SPDX-License-Identifier: MIT
#pragma once

// Which triangle sides of a disk lie on one another, and which on its rim.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace rattan::layout {

inline constexpr std::uint32_t kNoSide = 0xffffffffU;

/// Side 3 t + k runs from corner k of triangle t to the next corner.
struct DiskSides {
  std::vector<std::uint32_t> twin;  ///< one a side: the same edge from the other triangle, kNoSide
  std::vector<std::uint32_t> rim;   ///< sides without twin, counter-clockwise, the lowest first
};

/// The side after `side` around its triangle.
inline std::uint32_t next_side(std::uint32_t side) {
  return side % 3 == 2 ? side - 2 : side + 1;
}
inline std::uint32_t previous_side(std::uint32_t side) {
  return side % 3 == 0 ? side + 2 : side - 1;
}

/// Throws InternalError unless the triangles are a disk: connected, manifold, consistently
/// oriented, with one rim, Euler characteristic 1, and no vertex without a triangle.
DiskSides match_sides(std::span<const std::array<std::uint32_t, 3>> triangle, std::size_t vertices);

}  // namespace rattan::layout
