// SPDX-License-Identifier: MIT
#pragma once

// Triangulating one hole.

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "engine/core/types.h"

namespace rattan {

/// Triangles (i, j, k), i < j < k, over the corners of a closed loop of at least three, such that
/// none has a side among `taken`: pairs (i, j), i < j, of corners that an edge elsewhere joins
/// already, ascending. Up to kExactHole corners the least sum of squared sides, which keeps both
/// area and long sides small; beyond, ears cut from the shortest chord on. Empty: there is no such
/// triangulation, and the hole needs a vertex in its middle.
std::vector<std::array<std::uint32_t, 3>> triangulate_hole(
    std::span<const Vec3d> loop, std::span<const std::pair<std::uint32_t, std::uint32_t>> taken);

inline constexpr std::size_t kExactHole = 96;

}  // namespace rattan
