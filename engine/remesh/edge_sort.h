// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "engine/remesh/polygon_mesh.h"

namespace rattan {

/// One side of one face: from `corner`'s vertex to the next corner's.
struct FaceSide {
  std::uint32_t low = 0, high = 0;  ///< the two vertices, low <= high
  std::uint32_t corner = 0;
  std::uint32_t next = 0;  ///< the next corner of the face
  std::uint32_t face = 0;
};

/// All sides of all faces, sorted by (low, high, corner): those of one edge stand together.
std::vector<FaceSide> sorted_sides(const PolygonMesh& mesh);

}  // namespace rattan
