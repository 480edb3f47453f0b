// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/remesh/polygon_mesh.h"
#include "engine/remesh/surface_projector.h"

namespace rattan {

/// Closest points of the scan, one for each of `vertices`. The triangles that they lie on become
/// the vertices' PolygonMesh::scan_triangle, which also says where to begin; nothing moves.
std::vector<SurfacePoint> project_vertices(PolygonMesh& mesh,
                                           std::span<const std::uint32_t> vertices,
                                           SurfaceProjector& projector, TaskGraph& graph);

}  // namespace rattan
