// SPDX-License-Identifier: MIT
#pragma once

// What remains of a tile's arrangement once it is compressed: of output size, plus the tile's rim.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/layout/graph_keys.h"
#include "engine/layout/tile_arrangement.h"
#include "engine/mesh/features.h"

namespace rattan::layout {

inline constexpr std::uint8_t kCornerNode = 1;
/// Where feature curves meet or turn sharply.
inline constexpr std::uint8_t kFeatureCornerNode = 2;
inline constexpr std::uint8_t kFeatureEndNode = 4;  ///< in the middle of the surface

/// Longer edges get vertices in between, in units of the cells' side.
inline constexpr double kLongBoundary = 1.5;
inline constexpr double kLongInside = 2.5;

/// Where arcs end: crossings, ends of dangling lines, lines meeting the scan's boundary, corners of
/// the boundary, and every point of the graph on the tile's rim.
struct GraphNode {
  PointKey key;
  Vec3d position;
  std::uint64_t triangle = 0;  ///< lowest known global triangle it touches
  std::uint32_t face = kNone;  ///< a face beside it; set for points on the rim's edges
  std::uint8_t flags = 0;
};

/// A path of segments between nodes. Faces are the tile's local ones.
struct GraphArc {
  std::array<std::uint32_t, 2> node{kNone, kNone};  ///< kNone: a closed line without a node
  /// Place in the rotation about its ends: 0..3 counter-clockwise, or at a scan vertex the
  /// direction it leaves in (vertex_slot).
  std::array<std::uint64_t, 2> slot{0, 0};
  std::uint32_t left = 0;
  std::uint32_t right = 0;  ///< kNone beyond the scan's boundary
  std::int64_t length = 0;  ///< fixed point, so that sums don't depend on their order
  bool cut = false;         ///< contains a piece of a cut
  bool feature = false;     ///< contains a piece of a feature
};

/// Direction from a scan vertex: along the edge to a neighbour, or the line-th line to the left of
/// that edge.
inline std::uint64_t vertex_slot(std::uint64_t neighbor, std::uint32_t line) {
  return neighbor << 3 | line;
}
inline std::uint64_t slot_neighbor(std::uint64_t slot) {
  return slot >> 3;
}

/// One side of an edge whose other triangle, if there is one, belongs to another tile.
struct BorderEdge {
  std::uint64_t lo = 0;
  std::uint64_t hi = 0;
  std::uint64_t triangle = 0;     ///< global, the owned one
  std::uint32_t first_label = 0;  ///< into border_labels: local faces of its points + 1 pieces
  std::uint32_t points = 0;
  std::uint32_t first_node = 0;  ///< nodes of its points, in order
  std::uint32_t lo_node = kNone;
  std::uint32_t hi_node = kNone;
  bool left = false;  ///< the owned triangle is left of lo -> hi
  bool maybe_boundary = false;
  bool feature = false;
};

struct BorderVertex {
  std::uint64_t vertex = 0;
  std::uint32_t face = 0;
};

/// Rotation about a scan vertex where more than two parts of the graph may meet: neighbour number
/// `rank`, counter-clockwise.
struct FanEntry {
  std::uint64_t vertex = 0;
  std::uint64_t neighbor = 0;
  std::uint32_t rank = 0;
};

struct ArcPoint {
  Vec3d position;
  PointKey key;
  std::uint64_t triangle = 0;  ///< global; holds the segment to the next point
};

/// The points along an arc that is long by itself: few, and kept so that their tiles need not be
/// opened again.
struct ArcLine {
  std::uint32_t arc = 0;
  std::vector<ArcPoint> points;
};

struct TileGraph {
  /// Of each local face: cells - pieces + points and vertices that lie inside the tile and off the
  /// graph.
  std::vector<std::int32_t> euler;
  std::vector<std::uint8_t> singular;  ///< one a local face
  std::vector<GraphNode> nodes;
  std::vector<GraphArc> arcs;
  std::vector<BorderEdge> border_edges;
  std::vector<std::uint32_t> border_labels;
  std::vector<BorderVertex> border_vertices;
  std::vector<FanEntry> fans;
  std::vector<ArcLine> lines;  ///< ascending by arc
  /// Crossings, and points of edges that no other tile sees.
  std::uint32_t own_points = 0;

  std::size_t face_count() const { return euler.size(); }
  /// Of the large arrays.
  std::uint64_t bytes() const {
    return face_count() * (sizeof(std::int32_t) + 1) + nodes.size() * sizeof(GraphNode) +
           arcs.size() * sizeof(GraphArc) + border_edges.size() * sizeof(BorderEdge) +
           border_labels.size() * sizeof(std::uint32_t) +
           border_vertices.size() * sizeof(BorderVertex) + fans.size() * sizeof(FanEntry);
  }
};

/// A tile's graph with the way back from it to the arrangement.
struct TracedTile {
  TileGraph graph;
  std::vector<std::uint32_t> face_of_cell;
  std::vector<std::uint32_t> arc_of_segment;
  std::vector<std::uint32_t> arc_start;     ///< first dart
  std::vector<std::uint32_t> vertex_begin;  ///< graph vertices + 1, into vertex_darts
  std::vector<std::uint32_t> point_node;    ///< one an edge point; kNone where arcs pass
  std::vector<std::uint32_t> vertex_node;   ///< one a graph vertex; likewise
};

struct TraceOptions {
  double length_scale = 1.0;   ///< fixed-point units per length
  double side = 1.0;           ///< of the cells, in fixed-point units
  double corner_cosine = 0.5;  ///< boundary vertices that turn further are nodes
  const FeatureSet* features = nullptr;
};

/// Length of a segment in fixed point.
std::int64_t fixed_length(const Vec3d& a, const Vec3d& b, double scale);

/// `cuts`: those given to arrange_tile.
TracedTile trace_tile(const TileArrangement& a, std::span<const PointKey> cuts,
                      const TraceOptions& options);

/// Dart after `dart` on its arc; kNone if it ends at a node.
std::uint32_t next_dart(const TileArrangement& a, const TracedTile& traced, std::uint32_t dart);

/// f(dart) for the darts of an arc, from its first node on.
template <class F>
void for_each_dart_of_arc(const TileArrangement& a, const TracedTile& traced, std::uint32_t arc,
                          const F& f) {
  const std::uint32_t first = traced.arc_start[arc];
  for (std::uint32_t d = first; d != kNone;) {
    f(d);
    d = next_dart(a, traced, d);
    if (d == first) {
      return;
    }
  }
}

/// All points along an arc, ends included; a closed one repeats its first point.
std::vector<ArcPoint> arc_polyline(const TileArrangement& a, const TracedTile& traced,
                                   std::uint32_t arc);

}  // namespace rattan::layout
