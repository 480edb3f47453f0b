// SPDX-License-Identifier: MIT
#pragma once

// Charts put together from the pieces that tiles hold of them.

#include <cstdint>
#include <span>
#include <vector>

#include "engine/layout/chart_graph.h"
#include "engine/layout/chart_mesh.h"
#include "engine/layout/chart_pieces.h"

namespace rattan::layout {

/// Pieces of one tile, as read back.
struct PieceView {
  std::span<const PieceVertex> vertices;
  std::span<const PieceTriangle> triangles;  ///< ascending by chart
};

/// The charts [first, last), ascending; `pieces` hold all their triangles, and may hold those of
/// other charts. `nodes`: numbers of the graph's nodes, ascending. Order and bits of the result
/// depend on the order of `pieces`. Throws InternalError if a chart is not a disk.
std::vector<ChartMesh> assemble_charts(const ChartGraph& graph,
                                       std::span<const std::uint64_t> nodes, std::uint32_t first,
                                       std::uint32_t last, std::span<const PieceView> pieces,
                                       bool has_colours);

}  // namespace rattan::layout
