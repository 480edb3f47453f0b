// SPDX-License-Identifier: MIT
#pragma once

// Faces of a scan file with their texture coordinates and materials; internal to io/layout.

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "engine/core/types.h"
#include "io/layout/material.h"

namespace rattan {

inline constexpr std::uint64_t kNoTexture = std::numeric_limits<std::uint64_t>::max();
inline constexpr std::uint32_t kNoMaterial = std::numeric_limits<std::uint32_t>::max();

/// Receives a file as it streams. Vertices and texture vertices are numbered from 0 in the order
/// they come; triangles may refer to later ones.
class TexturedFaceSink {
 public:
  virtual ~TexturedFaceSink() = default;
  virtual void add_vertex(const Vec3d& position) = 0;
  virtual void add_texture_vertex(double u, double v) = 0;
  /// `texture`: kNoTexture where a corner has none. `material`: of the list returned at the end, or
  /// kNoMaterial.
  virtual void add_triangle(const std::array<std::uint64_t, 3>& vertex,
                            const std::array<std::uint64_t, 3>& texture,
                            std::uint32_t material) = 0;
};

/// Reads an OBJ or PLY file, plain or compressed; returns its materials. Other formats, which have
/// no textures, give nothing. Polygons are cut into fans. `pictures_only`: a PLY file that names no
/// picture gives nothing either. Throws InputError.
std::vector<Material> read_textured_faces(const std::string& scan, TexturedFaceSink& sink,
                                          bool pictures_only = true);

/// Of the single formats.
std::vector<Material> read_textured_obj(const std::string& scan, TexturedFaceSink& sink);
/// Pictures are those of the comments "TextureFile NAME". Texture coordinates are a list "texcoord"
/// of the faces, whose "texnumber" then says which picture, or two values of the vertices
/// (texture_u and texture_v, s and t, u and v).
std::vector<Material> read_textured_ply(const std::string& scan, TexturedFaceSink& sink,
                                        bool pictures_only);

}  // namespace rattan
