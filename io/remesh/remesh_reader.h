// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "engine/remesh/polygon_mesh.h"
#include "io/remesh/remesh_metadata.h"

namespace rattan {

/// A polygon mesh from a `.drc`, `.obj`, `.ply` or `.off` file (by extension, any case), held in
/// memory whole. Positions as the file has them; `metadata`, if not null, receives what a `.drc`
/// holds: its `origin` is to be added for full coordinates (zero for the other formats). Faces may
/// repeat a vertex or meet badly: nothing is repaired. Throws UsageError for another extension,
/// InputError for a file that cannot be read.
PolygonMesh read_polygons(const std::string& path, RemeshMetadata* metadata = nullptr);

/// As above with the origin added.
PolygonMesh read_polygons_full(const std::string& path);

}  // namespace rattan
