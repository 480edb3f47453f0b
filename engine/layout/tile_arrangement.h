// SPDX-License-Identifier: MIT
#pragma once

// The arrangement of iso-lines inside one tile's owned triangles: where lines cross scan edges, how
// they continue through each triangle, where they cross each other, and the cells they leave. All
// of it is combinatorial; floating point places points and decides the order of the two families
// along an edge, once per edge from the edge's own data.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/layout/graph_keys.h"
#include "engine/mesh/tile_mesh.h"
#include "engine/param/triangle_coordinates.h"

namespace rattan::layout {

/// How an edge lies with respect to the tile's owned triangles.
enum class EdgePlace : std::uint8_t {
  kOutside,   ///< no owned triangle
  kInside,    ///< both triangles owned
  kBorder,    ///< one owned, the other belongs to another tile
  kBoundary,  ///< one owned, no other exists
  kUnknown,   ///< one owned, and the tile cannot see whether another exists
};

/// Points inside a tile: an edge point's index, or a tagged crossing or vertex.
inline constexpr std::uint32_t kCrossingTag = 0x80000000U;
inline constexpr std::uint32_t kVertexTag = 0x40000000U;
inline constexpr std::uint32_t kTagMask = 0xc0000000U;

/// What a crossing on an edge is, in the gauge of the edge's lower vertex: bit 0 the family (theta
/// or phi), bit 1 set if the coordinate falls from lo to hi.
using PointKind = std::uint8_t;

/// The same in a gauge turned by r.
inline PointKind turn_kind(PointKind kind, std::uint32_t r) {
  const std::uint32_t family = kind & 1U;
  // (a, b) -> (b, -a): theta becomes minus phi, phi becomes theta; and so on.
  const bool flips = r == 2 || (r == 1 && family == 0) || (r == 3 && family == 1);
  const std::uint32_t turned = (family ^ (r & 1U)) | ((kind & 2U) ^ (flips ? 2U : 0U));
  return static_cast<PointKind>(turned);
}

/// A stretch of line, or of a scan edge that belongs to the graph, between two successive points.
/// Dart 2 s runs from -> to, dart 2 s + 1 back.
struct Segment {
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  std::uint32_t left = 0;      ///< cell
  std::uint32_t right = 0;     ///< cell; kNone beyond the scan's boundary
  std::uint32_t triangle = 0;  ///< owned triangle it lies in (or on the rim of)
};

/// Two lines crossing inside a triangle.
struct Crossing {
  Vec3d position;
  Vec2d place;  ///< barycentric, with respect to the triangle's second and third corner
  std::uint32_t triangle = 0;
  std::uint32_t index = 0;               ///< among the triangle's crossings
  std::array<std::uint32_t, 4> darts{};  ///< outgoing, counter-clockwise
};

/// A scan vertex that lies on the graph: on the scan's boundary, a feature or a cut, or at the end
/// of a line.
struct GraphVertex {
  std::uint32_t vertex = 0;    ///< local
  std::uint32_t triangle = 0;  ///< lowest owned triangle among its segments'; kNone if it has none
  bool boundary = false;
};

struct VertexDart {
  std::uint32_t graph_vertex = 0;
  std::uint32_t dart = 0;      ///< outgoing
  std::uint32_t neighbor = 0;  ///< local vertex at the other end of the scan edge
  /// 0 along that edge; else the line that leaves into the triangle to the left of it, counted
  /// counter-clockwise from 1.
  std::uint32_t line = 0;
};

struct TileArrangement {
  const TileMesh* mesh = nullptr;
  const TileCoordinates* coordinates = nullptr;

  std::vector<EdgePlace> place;            ///< one an edge
  std::vector<std::uint32_t> point_begin;  ///< edges + 1; edge e's points, from lo to hi
  std::vector<double> point_t;             ///< in [0, 1] from lo to hi, ascending on an edge
  std::vector<PointKind> point_kind;
  /// Outgoing darts of an edge point, counter-clockwise: along the edge to hi, into the left
  /// triangle, along the edge to lo, into the right triangle. kNone where there is none.
  std::vector<std::array<std::uint32_t, 4>> point_darts;
  std::vector<std::uint32_t> point_edge;

  /// Cell on either side of each piece; piece i of edge e is number point_begin[e] + e + i.
  std::vector<std::uint32_t> left_cell;
  std::vector<std::uint32_t> right_cell;
  std::vector<std::uint32_t> cell_begin;  ///< owned triangles + 1
  std::vector<std::uint8_t> open;         ///< one an owned triangle: singular

  std::vector<Segment> segments;
  std::uint32_t first_edge_segment = 0;       ///< segments from here on run along scan edges
  std::vector<std::uint8_t> segment_feature;  ///< one for each of these
  std::vector<Crossing> crossings;
  std::vector<GraphVertex> vertices;
  std::vector<std::uint32_t> graph_vertex;  ///< one a local vertex; kNone off the graph
  std::vector<VertexDart> vertex_darts;     ///< sorted by graph vertex, then neighbour's global id
  std::vector<std::uint8_t> piece_cut;      ///< one a piece: kCutPiece, kFeaturePiece or 0
  std::vector<std::uint8_t> edge_feature;   ///< one an edge

  std::uint32_t cell_count() const { return cell_begin.back(); }
  std::uint32_t piece(std::uint32_t edge, std::uint32_t i) const {
    return point_begin[edge] + edge + i;
  }
  std::uint32_t points_on(std::uint32_t edge) const {
    return point_begin[edge + 1] - point_begin[edge];
  }
  /// The graph vertex of a local vertex, made if need be.
  std::uint32_t graph_vertex_of(std::uint32_t local) {
    if (graph_vertex[local] == kNone) {
      graph_vertex[local] = static_cast<std::uint32_t>(vertices.size());
      vertices.push_back({local, kNone, false});
    }
    return graph_vertex[local];
  }
  std::uint32_t corner_cell(std::uint32_t triangle, std::uint32_t corner) const;
  Vec3d vertex_position(std::uint32_t local) const { return mesh->positions[local].cast<double>(); }
  Vec3d position(std::uint32_t point) const;
  PointKey key(std::uint32_t point) const;
  std::uint32_t start(std::uint32_t dart) const {
    const Segment& s = segments[dart >> 1];
    return (dart & 1U) == 0 ? s.from : s.to;
  }
  std::uint32_t end(std::uint32_t dart) const { return start(dart ^ 1U); }
  std::uint32_t left(std::uint32_t dart) const {
    const Segment& s = segments[dart >> 1];
    return (dart & 1U) == 0 ? s.left : s.right;
  }
};

inline constexpr std::uint8_t kCutPiece = 1;
inline constexpr std::uint8_t kFeaturePiece = 2;

/// `density`: lines a period. `cuts`: pieces of scan edges, sorted, that belong to the graph;
/// `creases`: scan edges as pairs of local vertices that do so wholly. The result refers to the
/// first two arguments. Deterministic. Throws TooManyCrossings if lines cross each other, or an
/// edge, more often than `most_crossings`. Points on an edge keep `gap` (or as much as there is
/// room for) from its ends and each other, in parts of the edge.
TileArrangement arrange_tile(const TileMesh& mesh, const TileCoordinates& coordinates, int density,
                             std::span<const PointKey> cuts,
                             std::span<const std::array<std::uint32_t, 2>> creases,
                             std::uint64_t most_crossings, double gap = 0.0);

}  // namespace rattan::layout
