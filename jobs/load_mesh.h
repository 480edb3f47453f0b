// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "engine/remesh/polygon_mesh.h"

namespace rattan {

/// A mesh as its file holds it: full coordinates are positions + origin.
struct LoadedMesh {
  PolygonMesh mesh;
  Vec3d origin = Vec3d::Zero();
};

/// Whether the name says that the file is Draco's.
bool is_draco(const std::string& path);

/// Whole, into memory: the polygons of a .drc, .obj, .ply or .off, or the triangles of a scan of
/// another format. Nothing is repaired. Throws InputError for what can't be read, has no faces or
/// has coordinates that are not finite.
LoadedMesh load_mesh(const std::string& path);

}  // namespace rattan
