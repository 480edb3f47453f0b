// SPDX-License-Identifier: MIT
#include "engine/remesh/project_vertices.h"

namespace rattan {

std::vector<SurfacePoint> project_vertices(PolygonMesh& mesh,
                                           std::span<const std::uint32_t> vertices,
                                           SurfaceProjector& projector, TaskGraph& graph) {
  std::vector<ProjectionQuery> queries(vertices.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    queries[i].point = mesh.positions[vertices[i]];
    queries[i].hint = mesh.scan_triangle[vertices[i]];
  }
  std::vector<SurfacePoint> found(vertices.size());
  projector.project(queries, found, graph);
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (found[i].found()) {
      mesh.scan_triangle[vertices[i]] = found[i].triangle;
    }
  }
  return found;
}

}  // namespace rattan
