// SPDX-License-Identifier: MIT
#pragma once

// What the numbering of charts means for one tile: which dart runs along which stretch of line or
// edge, and how points are numbered.

#include <cstdint>
#include <vector>

#include "engine/layout/chart_numbering.h"
#include "engine/layout/scan_arrangement.h"

namespace rattan::layout {

struct TileStrands {
  /// One a segment: the dart that runs from its first point to its second; kNone off the graph.
  std::vector<std::uint32_t> segment_dart;
  /// One a piece of a scan edge: the dart that runs from the lower vertex to the higher.
  std::vector<std::uint32_t> piece_dart;
  std::vector<std::uint64_t> point_number;  ///< one a point of scan edges
};

TileStrands tile_strands(const OpenTile& tile, TileId id, const ChartNumbering& numbering);

}  // namespace rattan::layout
