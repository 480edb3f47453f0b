// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "engine/remesh/polygon_mesh.h"
#include "io/picture/camera.h"

namespace rattan {

/// A mesh in single precision about the middle of its box, and how it is looked at.
struct MeshSight {
  std::vector<Vec3f> positions;
  Vec3d low, high;  ///< of the box, about its middle
  Camera::View view;

  explicit MeshSight(const PolygonMesh& mesh);
};

struct ThumbnailOptions {
  int width = 320;  ///< pixels
  int height = 240;
};

/// Bytes that draw_thumbnail() holds.
std::size_t thumbnail_bytes(const PolygonMesh& mesh, const ThumbnailOptions& options = {});

/// A small picture of a mesh with its edges, as the bytes of a PNG with a palette and a transparent
/// background: some milliseconds for 10,000 faces, where render() takes a second. Scan conversion
/// with a depth buffer on one thread; light from the upper left, no shadows. Edges fade where faces
/// are small; faces that are not quads are tinted where quads are the rule.
std::string draw_thumbnail(const PolygonMesh& mesh, const ThumbnailOptions& options = {});

}  // namespace rattan
