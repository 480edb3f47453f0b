// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "engine/mesh/features.h"
#include "engine/remesh/polygon_mesh.h"

namespace rattan {

/// Divides feature edges that somewhere lie further than `tolerance` (a length) from their curve,
/// at the nearest point of the curve, and splits the faces beside them: narrow bends keep their
/// shape at the cost of a few triangles. Returns the number of vertices added. Needs a simple mesh
/// of polygons, leaves one of triangles and quads.
std::uint64_t refine_creases(PolygonMesh& mesh, const FeatureSet& features, double tolerance);

}  // namespace rattan
