// SPDX-License-Identifier: MIT
#pragma once

// Folds between faces, taken out by other diagonals.

#include <cstdint>

#include "engine/remesh/polygon_mesh.h"

namespace rattan {

/// Where the normals of two faces turn by more than a right angle across an edge that is no
/// feature's, puts another edge in its place if that leaves less of a fold there and around.
/// Vertices stay where they are, and as many faces. Returns the number of edges replaced. Needs a
/// simple mesh of triangles and quads, leaves one.
std::uint64_t unfold_faces(PolygonMesh& mesh);

}  // namespace rattan
