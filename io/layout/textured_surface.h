// SPDX-License-Identifier: MIT
#pragma once

// A surface with texture coordinates read back whole, from whatever wrote it: for pictures.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/remesh/polygon_mesh.h"
#include "io/picture/scene.h"

namespace rattan {

struct TexturedSurface {
  PolygonMesh mesh;  ///< triangles; positions as in the file
  /// Three a triangle; NaN at all corners of a triangle without.
  std::vector<std::array<float, 2>> corner_uv;
};

/// Of an .obj, .ply (each plain or compressed) or .drc. Takes about 150 bytes a triangle. Throws
/// InputError, also for a file without texture coordinates.
TexturedSurface read_textured_surface(const std::string& path);

/// What the texture coordinates cut the surface into: Rattan's charts, or their quadrilaterals.
struct TexturePieces {
  std::vector<SurfaceLine> seams;  ///< edges between triangles whose coordinates differ there
  std::uint64_t count = 0;         ///< connected pieces with coordinates
  double area = 0.0;               ///< of all, on the surface
  double uv_area = 0.0;            ///< of all, in texture coordinates
};
/// Positions of the lines are the mesh's + shift.
TexturePieces texture_pieces(const TexturedSurface& surface, const Vec3d& shift);

}  // namespace rattan
