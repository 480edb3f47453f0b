// SPDX-License-Identifier: MIT
#pragma once

// Small maps given outright, changes made to them by place, and what every remesh must satisfy.

#include <cstdint>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "engine/layout/cell_complex.h"
#include "engine/remesh/cell_map.h"
#include "engine/remesh/topology.h"
#include "tests/engine/remesh/shapes.h"

namespace rattan::test {

/// A mesh given by the vertices of its faces; all vertices in a row.
inline PolygonMesh mesh_of(std::uint32_t vertices,
                           const std::vector<std::vector<std::uint32_t>>& faces) {
  PolygonMesh mesh;
  for (std::uint32_t v = 0; v < vertices; ++v) {
    mesh.positions.emplace_back(v, 0, 0);
  }
  for (const auto& face : faces) {
    mesh.add_face(face);
  }
  return mesh;
}

/// A complex given by faces of (vertex, edge) pairs.
inline CellComplex complex_of(
    std::uint32_t vertices, std::uint32_t edges,
    const std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>>& faces) {
  CellComplex cells;
  for (std::uint32_t v = 0; v < vertices; ++v) {
    cells.mesh.positions.emplace_back(v % 2, (v / 2) % 2, v % 3);
  }
  for (const auto& face : faces) {
    std::vector<std::uint32_t> corners;
    for (const auto& [v, e] : face) {
      corners.push_back(v);
      cells.corner_edge.push_back(e);
    }
    cells.mesh.add_face(corners);
  }
  cells.edge_count = edges;
  return cells;
}

/// The map of a mesh with normals from its faces.
inline CellMap map_of(PolygonMesh mesh) {
  CellMap map(std::move(mesh));
  map.set_normals({});
  return map;
}

inline bool is_inner_edge(const CellMap& map, std::uint32_t h) {
  return !map.is_hole(map.face(h)) && !map.is_hole(map.face(CellMap::twin(h)));
}

/// Erases inner edges between two cells where `wanted(p, q)` holds for their ends.
template <class Wanted>
void erase_edges(CellMap& map, const Wanted& wanted) {
  for (std::uint32_t h = 0; h < map.half_count(); h += 2) {
    if (map.half_alive(h) && is_inner_edge(map, h) && map.face(h) != map.face(CellMap::twin(h)) &&
        wanted(map.position(map.origin(h)), map.position(map.target(h)))) {
      map.erase_edge(h);
    }
  }
}

/// Contracts edges to their middle where `wanted(p, q)` holds for their ends.
template <class Wanted>
void contract_edges(CellMap& map, const Wanted& wanted) {
  for (std::uint32_t h = 0; h < map.half_count(); h += 2) {
    if (map.half_alive(h)) {
      const Vec3d p = map.position(map.origin(h)), q = map.position(map.target(h));
      if (wanted(p, q)) {
        map.contract_edge(h, Vec3d(0.5 * (p + q)));
      }
    }
  }
}

/// Whether the edge joins the points (x, y) and (x, y + 1) of a grid.
inline bool is_upright(const Vec3d& p, const Vec3d& q, int x, int y) {
  return p.x() == x && q.x() == x && std::min(p.y(), q.y()) == y;
}

/// Turns the edge of h to the next diagonal of the hexagon that its two quads make. False, and
/// nothing is done, if that would leave a double edge, a repeated corner or a vertex of a valence
/// below `least`.
inline bool turn_edge(CellMap& map, std::uint32_t h, std::uint32_t least = 3) {
  const std::uint32_t t = CellMap::twin(h);
  if (!map.half_alive(h) || !is_inner_edge(map, h) || map.face(h) == map.face(t) ||
      map.degree(map.face(h)) != 4 || map.degree(map.face(t)) != 4 ||
      map.valence(map.origin(h)) <= least || map.valence(map.target(h)) <= least) {
    return false;
  }
  const auto [u, v, p, q] = map.quad_corners(h);
  const auto [v2, u2, r, s] = map.quad_corners(t);
  if (p == r || p == s || q == r || q == s || map.adjacent(p, r)) {
    return false;
  }
  const std::uint32_t a = map.next(map.next(h)), b = map.next(map.next(t));  // out of p and r
  map.erase_edge(h);
  map.split_face(a, b);
  return true;
}

/// Nothing is wrong with the mesh, and it has the topology of `before`.
inline void expect_kept(const CellMap::Counts& before, const PolygonMesh& mesh) {
  const MeshTopology t = check_topology(mesh);
  EXPECT_EQ(t.bad_degree, 0U);
  EXPECT_EQ(t.repeated_vertex, 0U);
  EXPECT_EQ(t.duplicate_faces, 0U);
  EXPECT_EQ(t.non_manifold_edges, 0U);
  EXPECT_EQ(t.inconsistent_edges, 0U);
  EXPECT_EQ(t.non_manifold_vertices, 0U);
  EXPECT_EQ(t.valence_two, 0U);
  EXPECT_EQ(t.short_loops, 0U);
  EXPECT_EQ(t.unreferenced, 0U);
  EXPECT_TRUE(t.clean());
  EXPECT_EQ(t.euler(), before.euler());
  EXPECT_EQ(static_cast<std::int64_t>(t.components), before.components);
  EXPECT_EQ(static_cast<std::int64_t>(t.boundary_loops), before.boundary_loops);
}

}  // namespace rattan::test
