// SPDX-License-Identifier: MIT
#pragma once

// Quadric error of the scan around each vertex of the remesh (Garland and Heckbert 1997): where the
// vertex should lie so that the planes of the scan nearby pass through it.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/store.h"
#include "engine/core/task_graph.h"
#include "engine/mesh/tile_mesh.h"

namespace rattan {

/// sum_t a_t (n_t . delta - d_t)^2 over scan triangles t of area a_t and unit normal n_t whose
/// plane lies d_t off the vertex; delta is the vertex' displacement.
struct VertexQuadric {
  std::array<double, 6> nn{};  ///< sum a n n^T: xx, xy, xz, yy, yz, zz
  std::array<double, 3> nd{};  ///< sum a n d
  double area = 0.0;
};

/// Each triangle of the scan counts for the remesh vertex nearest to its centroid, among those
/// within `reach` whose normal does not face away from it; triangles without such a vertex count
/// for none. One pass over the tiles; sums run in the order of the triangles, whatever the tiles.
/// `normals` are unit, one a position.
std::vector<VertexQuadric> gather_quadrics(Store& store, const ScanMesh& mesh,
                                           std::span<const Vec3d> positions,
                                           std::span<const Vec3d> normals, double reach,
                                           TaskGraph& graph);

/// Minimises the quadric plus area (tangential |delta_t|^2 + normal |delta_n|^2), the parts of
/// delta along and across the unit `vertex_normal`. Zero where the quadric is empty.
Vec3d quadric_displacement(const VertexQuadric& quadric, const Vec3d& vertex_normal,
                           double tangential_weight, double normal_weight);

/// Mean squared sine between the scan's normals and the unit `vertex_normal`: 0 on a plane, 1/2 on
/// a crease of 90 degrees. 1 if the quadric is empty.
double bentness(const VertexQuadric& quadric, const Vec3d& vertex_normal);

}  // namespace rattan
