// SPDX-License-Identifier: MIT
#pragma once

// Takes quads out of a mesh by bringing two opposite corners together.

#include <cstdint>

#include "engine/remesh/cell_map.h"

namespace rattan {

/// Whether the quad of half-edge h can go by merging origin(h) with the opposite corner: the map
/// stays simple, no vertex falls to valence two (nor loses its last inner edge on the boundary
/// or on one side of a crease),
/// corners, boundary loops and feature curves stay.
bool collapsible(const CellMap& map, std::uint32_t h);

/// Where the two corners would meet: half-way, or at the one that is on a boundary or a corner of
/// it.
Vec3d collapsed_position(const CellMap& map, std::uint32_t h);

/// Does so. Pre: collapsible. Returns the vertex that is left.
std::uint32_t collapse_quad(CellMap& map, std::uint32_t h);

/// Collapses quads as long as that leaves the vertices around more regular, best first, ties by
/// face. Pre and post: a simple map of triangles and quads. Returns how many went.
std::uint64_t collapse_irregular(CellMap& map);

}  // namespace rattan
