// SPDX-License-Identifier: MIT
#pragma once

// Two triangles joined by a strip of quads become quads; so does one triangle joined to the
// boundary, where a boundary edge is divided for it.

#include <cstdint>

#include "engine/remesh/cell_map.h"

namespace rattan {

struct PairReport {
  std::uint64_t pairs = 0;      ///< two triangles removed by each
  std::uint64_t at_border = 0;  ///< one triangle removed by each, one boundary vertex added
};

/// Re-splits unions of triangle, up to `max_between` quads, triangle or boundary where that is
/// cheaper than what is there. Candidates are found in parallel and carried out in the order of
/// their gain, ties by face; shorter strips first. Pre and post: all cells are triangles and quads
/// without repeated vertices, the map is simple. `firm_curves`: vertices on features stay where
/// they are (see PolygonCorners::firm).
PairReport pair_triangles(CellMap& map, std::uint32_t max_between, bool firm_curves = false);

}  // namespace rattan
