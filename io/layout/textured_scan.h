// SPDX-License-Identifier: MIT
#pragma once

// A scan with the pictures on it, in memory: where a baked texture takes its colours from.

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/core/types.h"
#include "engine/remesh/triangle_index.h"
#include "io/layout/material.h"
#include "io/picture/image.h"

namespace rattan {

/// What a scan file has of textures.
struct TextureOutline {
  std::uint64_t vertices = 0;
  std::uint64_t texture_vertices = 0;
  std::uint64_t triangles = 0;
  std::uint64_t textured = 0;  ///< triangles with texture coordinates and a picture
  std::uint64_t pixels = 0;    ///< of all pictures
  /// The most that a TexturedScan of it takes, loading included; 0 if nothing is textured.
  std::uint64_t bytes = 0;
  std::vector<std::string> files;  ///< that its materials come from and refer to
};

/// Reads through an OBJ or PLY file, its materials and the headers of its pictures; formats without
/// textures give zeros. Throws InputError, e.g. for a picture that is missing.
TextureOutline outline_textures(const std::string& scan);

/// Triangles are sorted along a space-filling curve and have numbers of their own. Thread safe.
class TexturedScan {
 public:
  /// Coordinates of the file minus `origin`, divided by `unit` (see ScanMesh), are what points are
  /// given in. Throws InputError.
  TexturedScan(const std::string& scan, const TextureOutline& outline, const Vec3d& origin,
               double unit = 1.0);
  TexturedScan(const TexturedScan&) = delete;
  TexturedScan& operator=(const TexturedScan&) = delete;

  /// The triangle closest to p; `hint`, any triangle, saves time. Pre: there are triangles.
  std::uint32_t nearest(const Vec3d& p, std::uint32_t hint = 0) const;
  /// Whether the point is one of the triangle's, up to rounding.
  bool holds(std::uint32_t triangle, const Vec3d& p) const;
  /// Texture coordinates at the point of the triangle closest to p; zero where it has none.
  Vec2d texture(std::uint32_t triangle, const Vec3d& p) const;
  /// Of the triangle's material at these texture coordinates, 0 to 255 a channel: its picture
  /// between the four nearest pixels, or its colour where there is no picture.
  std::array<double, 3> colour(std::uint32_t triangle, const Vec2d& texture) const;

  std::uint64_t triangles() const { return triangles_.size(); }

 private:
  class Loader;
  void sort_triangles();
  void load_pictures();

  std::string scan_;
  std::vector<Vec3f> positions_;
  std::vector<std::array<float, 2>> texture_;
  std::vector<LocalTriangle> triangles_;
  std::vector<LocalTriangle> texture_corners_;  ///< one a triangle; kBare: none
  std::vector<std::uint32_t> material_of_;
  std::vector<Material> materials_;
  std::vector<std::uint32_t> picture_of_;  ///< one a material, into pictures_, or kBare
  std::vector<Image> pictures_;
  std::unique_ptr<TriangleIndex> index_;
  double tolerance2_ = 0.0;
};

}  // namespace rattan
