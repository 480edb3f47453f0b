// SPDX-License-Identifier: MIT
#pragma once

// A combinatorial map (half-edges) that may hold loops, multi-edges, 1-gons and 2-gons, with the
// Euler operations of the remesher. Every operation keeps components, boundary loops and the Euler
// characteristic. Boundary loops are faces too ("holes"), so walks around a vertex never stop.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/layout/cell_complex.h"
#include "engine/remesh/polygon_mesh.h"

namespace rattan {

/// Half-edges 2e and 2e + 1 are the two sides of edge e. Ids of deleted elements stay dead; ids of
/// new ones are appended, so an order by id is an order of creation.
class CellMap {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffU;

  /// Throws InternalError if an edge id occurs more than twice or twice in one direction. A vertex
  /// whose corners form several fans is divided, one vertex a fan.
  explicit CellMap(CellComplex&& cells);
  /// A mesh without loops and multi-edges; edges are matched by their end points. Throws
  /// InternalError if an edge has more than two faces or two of one direction.
  explicit CellMap(PolygonMesh&& mesh);

  std::uint32_t half_count() const { return static_cast<std::uint32_t>(next_.size()); }
  std::uint32_t face_count() const { return static_cast<std::uint32_t>(face_half_.size()); }
  std::uint32_t vertex_count() const { return static_cast<std::uint32_t>(vertex_half_.size()); }

  bool half_alive(std::uint32_t h) const { return origin_[h] != kNone; }
  bool face_alive(std::uint32_t f) const { return face_half_[f] != kNone; }
  bool vertex_alive(std::uint32_t v) const { return vertex_half_[v] != kNone; }
  /// Alive and not a hole.
  bool is_cell(std::uint32_t f) const { return face_alive(f) && !hole_[f]; }
  bool is_hole(std::uint32_t f) const { return hole_[f] != 0; }

  static std::uint32_t twin(std::uint32_t h) { return h ^ 1U; }
  std::uint32_t next(std::uint32_t h) const { return next_[h]; }
  std::uint32_t prev(std::uint32_t h) const { return prev_[h]; }
  std::uint32_t origin(std::uint32_t h) const { return origin_[h]; }
  std::uint32_t target(std::uint32_t h) const { return origin_[twin(h)]; }
  std::uint32_t face(std::uint32_t h) const { return face_[h]; }
  /// The next half-edge out of the same vertex, counter-clockwise.
  std::uint32_t around(std::uint32_t h) const { return twin(prev_[h]); }
  std::uint32_t face_half(std::uint32_t f) const { return face_half_[f]; }
  std::uint32_t vertex_half(std::uint32_t v) const { return vertex_half_[v]; }
  std::uint32_t degree(std::uint32_t f) const { return degree_[f]; }
  /// The corners of the quad of h in order, from origin(h) on.
  std::array<std::uint32_t, 4> quad_corners(std::uint32_t h) const {
    return {origin(h), target(h), target(next(h)), origin(prev(h))};
  }
  /// Ends of edges at the vertex; a loop counts twice.
  std::uint32_t valence(std::uint32_t v) const { return valence_[v]; }
  bool on_boundary(std::uint32_t v) const { return (flags_[v] & kBoundaryVertex) != 0; }
  bool on_feature(std::uint32_t v) const { return (flags_[v] & kFeatureVertex) != 0; }
  /// On the boundary or a feature.
  bool on_curve(std::uint32_t v) const {
    return (flags_[v] & (kBoundaryVertex | kFeatureVertex)) != 0;
  }
  /// The edge follows a feature of the scan.
  bool is_feature(std::uint32_t h) const { return feature_[h >> 1] != 0; }
  void set_feature(std::uint32_t h, bool feature);
  bool is_corner(std::uint32_t v) const { return (flags_[v] & kCornerVertex) != 0; }
  void set_corner(std::uint32_t v) { flags_[v] |= kCornerVertex; }
  const Vec3d& position(std::uint32_t v) const { return positions_[v]; }
  void set_position(std::uint32_t v, const Vec3d& p) { positions_[v] = p; }
  const Vec3d& normal(std::uint32_t v) const { return normals_[v]; }
  double length(std::uint32_t h) const {
    return (positions_[target(h)] - positions_[origin_[h]]).norm();
  }

  /// Half-edge from u to v, kNone if there is none. O(valence).
  std::uint32_t find_half(std::uint32_t u, std::uint32_t v) const;
  bool adjacent(std::uint32_t u, std::uint32_t v) const { return find_half(u, v) != kNone; }
  /// Half-edges of the face in order, appended to `out` after clearing it.
  void face_halves(std::uint32_t f, std::vector<std::uint32_t>& out) const;
  Vec3d face_centre(std::uint32_t f) const;
  /// Twice the vector area.
  Vec3d face_normal(std::uint32_t f) const;

  /// Merges the two faces of h (distinct, together of degree above two) into one; returns it.
  std::uint32_t erase_edge(std::uint32_t h);
  /// Merges target(h) into origin(h), which differ; the edge isn't a whole component.
  void contract_edge(std::uint32_t h, const Vec3d& position);
  /// A new vertex on the edge; returns the half-edge from it to the old target(h).
  std::uint32_t split_edge(std::uint32_t h, const Vec3d& position);
  /// A new edge between the corners h1 and h2 of one face; returns the half-edge from origin(h2) to
  /// origin(h1), which lies in a face with h1 (its twin with h2).
  std::uint32_t split_face(std::uint32_t h1, std::uint32_t h2);
  /// A new vertex inside the face joined to the given corners (in face order, two or more).
  std::uint32_t star_face(std::uint32_t f, std::span<const std::uint32_t> corners,
                          const Vec3d& position);
  /// A ring of quads of fresh vertices inside the face; the inner polygon keeps the id f.
  void inset_face(std::uint32_t f);

  /// Unit normals, one a vertex; from the faces if `given` is empty.
  void set_normals(std::span<const Vec3d> given);

  /// Alive cells as a plain mesh with flags (and scan triangles if there were some); vertices and
  /// faces keep their order.
  PolygonMesh to_mesh() const;

  struct Counts {
    std::int64_t vertices = 0, edges = 0, faces = 0, components = 0, boundary_loops = 0;
    std::int64_t euler() const { return vertices - edges + faces; }
  };
  Counts counts() const;
  /// Checks every link; for tests. Throws InternalError.
  void validate() const;

 private:
  void connect(PolygonMesh&& mesh, std::span<const std::uint32_t> corner_edge,
               std::uint32_t edge_count);
  void link(std::uint32_t a, std::uint32_t b) {
    next_[a] = b;
    prev_[b] = a;
  }
  std::uint32_t add_edge();
  std::uint32_t add_face(bool hole);
  /// Attributes of a new vertex come from `source`.
  std::uint32_t add_vertex(const Vec3d& position, const Vec3d& normal, std::uint32_t source,
                           std::uint8_t flags);
  void kill_edge(std::uint32_t h) { origin_[h] = origin_[twin(h)] = kNone; }

  std::vector<std::uint32_t> next_, prev_, origin_, face_;
  std::vector<std::uint8_t> feature_;  ///< one an edge
  std::vector<std::uint32_t> face_half_, degree_;
  std::vector<std::uint8_t> hole_;
  std::vector<std::uint32_t> vertex_half_, valence_;
  std::vector<Vec3d> positions_, normals_;
  std::vector<std::uint8_t> flags_;
  std::vector<std::uint64_t> scan_triangle_;
};

}  // namespace rattan
