// SPDX-License-Identifier: MIT
#pragma once

// From the stitched arrangement to charts: which face, arc and point becomes which chart, strand
// and vertex number.

#include <compare>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/tile_layout.h"
#include "engine/layout/chart_graph.h"
#include "engine/layout/graph_keys.h"
#include "engine/layout/stitch.h"

namespace rattan::layout {

/// Points of a scan edge that two tiles see: numbered once, from the lower vertex on.
struct RimPoints {
  std::uint64_t lo = 0;
  std::uint64_t hi = 0;
  std::uint64_t first = 0;  ///< number
};

/// A piece of such an edge that belongs to a strand.
struct RimPiece {
  PointKey piece;
  std::uint32_t dart = 0;  ///< the one that runs from the lower vertex to the higher
};

struct ChartNumbering {
  /// Complete but for the numbers of nodes that are no scan vertices, and which charts are
  /// singular.
  ChartGraph graph;
  std::vector<PointKey> node_key;  ///< ascending
  /// One a face of the tiles' graphs (tile t's from face_base[t] on).
  std::vector<std::uint32_t> chart_of_face;
  std::vector<std::uint32_t> face_base;    ///< tiles + 1
  std::vector<std::uint32_t> chart_begin;  ///< tiles + 1: charts that the tile is the first to see
  /// One an arc of the tiles' graphs: the dart that runs along it; kNone off the graph.
  std::vector<std::uint32_t> dart_of_arc;
  std::vector<std::uint32_t> arc_base;  ///< tiles + 1
  std::vector<RimPoints> rim_points;    ///< ascending by edge; only where there are points
  std::vector<RimPiece> rim_pieces;     ///< ascending
  /// Tiles + 1. A tile's points are numbered from here on: crossings, then points of edges that it
  /// alone sees, in the order of edges, then those of rim edges that it is the first to see.
  std::vector<std::uint64_t> point_begin;

  /// Tile in whose range a chart lies.
  std::uint32_t home(std::uint32_t chart) const;
  std::uint64_t rim_first(std::uint64_t lo, std::uint64_t hi) const;
};

/// `tiles`: the graphs that `skeleton` was stitched from, all faces disks. `first_point`: number of
/// the first point, behind the scan's vertices. `side`: of a chart, in the skeleton's fixed point.
ChartNumbering number_charts(Skeleton& skeleton, std::span<const TileGraph> tiles,
                             std::uint64_t first_point, double side);

}  // namespace rattan::layout
