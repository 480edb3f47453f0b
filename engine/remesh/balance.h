// SPDX-License-Identifier: MIT
#pragma once

// Fewer irregular vertices by local exchanges between quads.

#include <cstdint>

#include "engine/remesh/cell_map.h"

namespace rattan {

struct BalanceReport {
  std::uint64_t collapsed = 0;  ///< quads whose opposite corners were merged
  std::uint64_t turned = 0;     ///< edges between two quads exchanged for another diagonal
};

/// Where that lowers the sum of (valence - 4)^2: merges two opposite corners of a quad (3 + 4
/// opposite 5 + 5 leaves one 5), or turns the edge between two quads. Away from the boundary only.
/// Pre and post: as of split_cells, and the map stays simple; doublets and faces on equal vertices
/// may come up, so repair() follows. In a fixed order.
BalanceReport balance_valences(CellMap& map);

}  // namespace rattan
