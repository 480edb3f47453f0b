// SPDX-License-Identifier: MIT
#pragma once

// The last step of the guarantee: no interior vertex of valence two, no two faces on the same
// vertices, and no quad that cannot be cut into two triangles.

#include <cstdint>

#include "engine/remesh/cell_map.h"

namespace rattan {

struct RepairReport {
  std::uint64_t doublets = 0;  ///< interior vertices of valence two removed
  std::uint64_t insets = 0;
};

/// Pre: a simple map whose cells are triangles and quads without repeated vertices. Post: also the
/// two properties above. Removes vertices of valence two where that is legal, else insets a face,
/// which always is.
RepairReport repair(CellMap& map);

/// Insets every quad both of whose diagonals join vertices that an edge joins already, and all but
/// one of several quads left with the same only diagonal: cut into triangles, as formats that know
/// only triangles must, they would double an edge. Returns how many were inset. Keeps all
/// properties above.
std::uint64_t inset_undividable_quads(CellMap& map);

}  // namespace rattan
