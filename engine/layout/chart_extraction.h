// SPDX-License-Identifier: MIT
#pragma once

// The chart layout of a scan (PGP 3.3): its graph in memory, its charts in pieces in the store.

#include <cstdint>
#include <optional>
#include <vector>

#include "engine/core/store.h"
#include "engine/core/task_graph.h"
#include "engine/layout/arrangement.h"
#include "engine/layout/chart_graph.h"
#include "engine/layout/chart_mesh.h"
#include "engine/layout/chart_pieces.h"
#include "engine/mesh/tile_mesh.h"

namespace rattan {

/// A vertex of the layout's triangulation that lies where lines cross edges or each other.
struct LayoutPoint {
  Vec3f position;  ///< like fields::kPosition
  Rgba colour{};
};

namespace fields {
/// Of each tile: pieces of charts whose home it is, and of others; see ChartPieces.
inline constexpr Field<layout::PieceVertex> kOwnPieceVertex{"layout/own_vertex"};
inline constexpr Field<layout::PieceTriangle> kOwnPiece{"layout/own_triangle"};
inline constexpr Field<layout::PieceVertex> kForeignPieceVertex{"layout/foreign_vertex"};
inline constexpr Field<layout::PieceTriangle> kForeignPiece{"layout/foreign_triangle"};
/// Points numbered by the tile, in order.
inline constexpr Field<LayoutPoint> kLayoutPoint{"layout/point"};
}  // namespace fields

struct ChartLayout {
  ChartGraph graph;
  std::vector<std::uint64_t> sorted_nodes;  ///< graph.node_vertex, ascending
  std::vector<std::uint32_t> chart_begin;   ///< tiles + 1: charts whose home a tile is
  std::vector<std::uint64_t> point_begin;   ///< tiles + 1: numbers of the tile's points
  /// Tiles + 1, into `contributors`: other tiles that hold pieces of a tile's charts, ascending.
  std::vector<std::uint32_t> contributor_begin;
  std::vector<std::uint32_t> contributors;
  std::uint32_t singular_charts = 0;
};

template <class A>
void members_of(A& a, ChartGraph& g) {
  a(g.first_division);
  a(g.units);
  a(g.node_position);
  a(g.node_vertex);
  a(g.strands);
  a(g.division_begin);
  a(g.ring_begin);
  a(g.ring_darts);
  a(g.chart_singular);
}

template <class A>
void members_of(A& a, ChartLayout& l) {
  a(l.graph);
  a(l.sorted_nodes);
  a(l.chart_begin);
  a(l.point_begin);
  a(l.contributor_begin);
  a(l.contributors);
  a(l.singular_charts);
}

/// Charts with more sides are crowded.
inline constexpr std::uint32_t kManyChartSides = 24;

struct ChartExtraction {
  ArrangementReport lines;
  /// Charts that were no disks before they were cut.
  std::uint64_t not_disks = 0;
  std::uint64_t cuts = 0;  ///< that these need at least
  /// Charts with too many sides to be parameterized well, and by how many in all.
  std::uint64_t crowded = 0;
  std::uint64_t excess = 0;
  std::uint64_t still_crowded = 0;  ///< after they were divided
};

/// Reads what extract_cells reads. `options.density` 1 gives the paper's charts. Without `cut`,
/// nothing is made if some chart is no disk or crowded. Every chart of the result is one. Memory:
/// the lines on the surface as for extract_cells, and the graph. Throws like extract_cells.
std::optional<ChartLayout> extract_charts(Store& store, const ScanMesh& mesh,
                                          const ArrangementOptions& options, bool cut,
                                          TaskGraph& graph, ChartExtraction& report);

/// What the store holds of a home tile's charts, pinned.
struct ChartChunks {
  struct Chunk {
    ChunkView<layout::PieceVertex> vertices;
    ChunkView<layout::PieceTriangle> triangles;
  };
  std::vector<Chunk> chunks;
};
ChartChunks load_pieces(Store& store, const ChartLayout& layout, TileId tile);

/// Once all charts are parameterized, their pieces are of no more use.
void erase_pieces(Store& store);

/// The charts of a home tile, ascending.
std::vector<ChartMesh> assemble_charts(const ChartChunks& pieces, const ChartLayout& layout,
                                       TileId tile, bool has_colours);

}  // namespace rattan
