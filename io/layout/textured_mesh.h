// SPDX-License-Identifier: MIT
#pragma once

// A triangulation with texture coordinates, whole in memory, as Draco files hold it.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/mesh/scan_sink.h"

namespace rattan {

struct TexturedMesh {
  std::vector<std::array<float, 3>> position;          ///< one a vertex
  std::vector<Rgba> colour;                            ///< one a vertex, or empty
  std::vector<std::array<float, 2>> uv;                ///< one a texture vertex
  std::vector<std::uint32_t> vertex;                   ///< one a texture vertex
  std::vector<std::uint32_t> chart;                    ///< one a texture vertex
  std::vector<std::array<std::uint32_t, 3>> triangle;  ///< of texture vertices
};

/// Isomorphic: one-to-one maps of the vertices, of the texture vertices and of the triangles that
/// agree with each other and keep positions, colours, texture coordinates and charts to the last
/// bit and the orientation of triangles. So neither a weld nor a tear passes, on the surface or in
/// a chart. Empty when isomorphic, else a clause saying what differs. Triangles that are alike to
/// the last bit are told apart by what they are connected to. Pre: every vertex and texture vertex
/// is used.
std::string difference_of(const TexturedMesh& meant, const TexturedMesh& read);

}  // namespace rattan
