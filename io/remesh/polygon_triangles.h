// SPDX-License-Identifier: MIT
#pragma once

// Splitting polygons into triangles so that the polygons can be found again from the triangles.

#include <cstdint>
#include <vector>

#include "engine/remesh/polygon_mesh.h"

namespace rattan {

/// For each face the corner from which it is cut as a fan: triangle t of a face of degree n with
/// apex a has the corners a, a+t+1, a+t+2 (modulo n), t < n - 2. No diagonal joins two vertices
/// that an edge or another diagonal joins: a doubled edge would be non-manifold as triangles, and
/// Draco tears those apart. Among the fans allowed, the one that folds least, then the shortest
/// diagonals.
///
/// Pre: no face repeats a vertex. Throws InternalError where no such choice is found (a face whose
/// opposite corners are all joined by edges elsewhere).
std::vector<std::uint32_t> choose_fan_apexes(const PolygonMesh& mesh);

}  // namespace rattan
