// SPDX-License-Identifier: MIT
#pragma once

// Divides every cell of a simple map into quads and triangles.

#include <cstdint>
#include <span>
#include <vector>

#include "engine/remesh/cell_map.h"
#include "engine/remesh/split_polygon.h"

namespace rattan {

/// Fills `corners` from half-edges around a cell (or around a union of cells). Half-edges listed in
/// `ignored` don't forbid a diagonal between their ends.
void gather_corners(const CellMap& map, std::span<const std::uint32_t> halves,
                    std::span<const std::uint32_t> ignored, PolygonCorners& corners);

/// What one step of a vertex's valence away from four costs, in the unit of the splitter's cost.
inline constexpr double kValenceCost = 0.4;

/// Distance of an interior vertex's valence from four; zero on the boundary.
inline double irregularity(const CellMap& map, std::uint32_t v, std::uint32_t valence) {
  const double off = static_cast<double>(valence) - 4.0;
  return map.on_boundary(v) ? 0.0 : (off < 0 ? -off : off);
}

/// Carries out a split of the cell whose half-edges are `halves`, in the order the split was made
/// for. False, and the map unchanged, if a diagonal has become an edge meanwhile.
bool apply_split(CellMap& map, std::span<const std::uint32_t> halves, const PolygonSplit& split);

struct SplitReport {
  std::uint64_t insets = 0;
  std::uint64_t stars = 0;
  std::uint64_t rounds = 0;
};

/// Pre: no loops, no multi-edges, no vertex of valence one. Post: also, all cells are triangles or
/// quads without repeated vertices. Splits are found in parallel and carried out in face order.
SplitReport split_cells(CellMap& map);

}  // namespace rattan
