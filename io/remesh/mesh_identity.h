// SPDX-License-Identifier: MIT
#pragma once

// Is what was read back the mesh that was meant, up to the numbering of vertices and faces and the
// corner a face starts from?

#include <string>

#include "engine/remesh/polygon_mesh.h"

namespace rattan {

/// Same numbering, same corners, same colours, positions equal to the last bit. Empty when
/// identical, else a clause saying the first difference.
std::string difference_in_order(const PolygonMesh& meant, const PolygonMesh& read);

/// Isomorphic: a one-to-one map of vertices that keeps positions (to the last bit) and colours and
/// maps the faces one-to-one, orientation kept. Where several vertices share a position the map
/// follows the connectivity from face to face, so that neither a weld nor a tear nor a swap passes.
/// Pre: no two faces use an edge in the same direction. Empty when isomorphic, else what differs.
std::string difference_as_meshes(const PolygonMesh& meant, const PolygonMesh& read);

}  // namespace rattan
