// SPDX-License-Identifier: MIT
#pragma once

// One disk with its rim on a square: the inside.

#include <cstdint>

#include "engine/layout/flat_disk.h"

namespace rattan::layout {

struct MapReport {
  std::uint32_t nudged = 0;  ///< vertices moved singly because of folded or thin triangles
  std::uint32_t thin = 0;    ///< triangles left below kLeastThickness, none folded
};

/// Puts the inside vertices where mean value coordinates, reweighted while that lowers the stretch,
/// want them; splits chords. If some triangle is below the floor, in this order: moves single
/// vertices; splits the other chords too and reweights further; starts from equal weights; takes
/// the best of these. The rim must be convex and its triangles' sides on it not too short (see
/// kLeastGap). Throws InternalError if every one of these maps is folded.
MapReport map_to_square(FlatDisk& disk);

/// Starts from uv that are there, whose rim has been moved to its strands' parameters since:
/// `moved` is one a vertex, by how much (inside 0). Spreads large movements over the inside, then
/// splits and nudges as above. False if some triangle stays below the floor.
bool mend_unfolded(FlatDisk& disk, const std::vector<Vec2d>& moved, MapReport& report);

}  // namespace rattan::layout
