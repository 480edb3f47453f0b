// SPDX-License-Identifier: MIT
#pragma once

// A locally shortest path across a chart that keeps off its walls, and the cut along it.

#include <vector>

#include "engine/layout/cut_mesh.h"

namespace rattan::layout {

/// A point of a path: a vertex, or in an edge at share of the way along halfedge.
struct PathPoint {
  VertexHandle vertex;
  HalfedgeHandle halfedge;  ///< invalid at a vertex
  double share = 0;         ///< in (0, 1)

  bool at_vertex() const { return vertex.is_valid(); }
};

/// From one vertex to another; both may be walls, nothing between touches one. Next points share a
/// triangle; no vertex and no triangle is passed twice. Near a wall's end of an edge, and near any
/// vertex, the path keeps some distance or goes through the vertex, for the sake of the triangles.
/// Never longer than the shortest way over vertices and middles of edges. Throws InternalError if
/// walls separate the two.
std::vector<PathPoint> geodesic_path(const CutMesh& mesh, VertexHandle from, VertexHandle to);

/// Cuts the edges that the path crosses, whereby it becomes edges, and makes them walls. Returns
/// its vertices.
std::vector<VertexHandle> cut_along(CutMesh& mesh, const std::vector<PathPoint>& path);

}  // namespace rattan::layout
