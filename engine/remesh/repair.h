// SPDX-License-Identifier: MIT
#pragma once

// The last step of the guarantee: no interior vertex of valence two, no two faces on the same
// vertices.

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

}  // namespace rattan
