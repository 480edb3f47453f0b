// SPDX-License-Identifier: MIT
#pragma once

// Makes a cell complex simple: what is too small goes, what is doubled is divided.

#include <cstdint>

#include "engine/remesh/cell_map.h"

namespace rattan {

struct CleanReport {
  std::uint64_t erased_edges = 0;      ///< of 1-gons and 2-gons
  std::uint64_t contracted_edges = 0;  ///< short ones
  std::uint64_t joined_edges = 0;      ///< vertices of valence two removed
  std::uint64_t split_edges = 0;       ///< loops, multi-edges, boundary loops below three edges
};

/// After this the map has no loop, no multi-edge, no vertex of valence one, and boundary loops of
/// at least three edges; cells have three corners or more. `side` is the length of a good edge;
/// edges are contracted only if `contract_below` (a share of `side`) is positive. Corner and
/// boundary vertices keep their places, but for boundary vertices on short edges.
CleanReport clean(CellMap& map, double side, double contract_below);

}  // namespace rattan
