// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "engine/layout/cell_complex.h"
#include "engine/layout/stitch.h"
#include "engine/layout/tile_graph.h"

namespace rattan::layout {

struct ArcRequest {
  std::uint32_t tile = 0;
  std::uint32_t arc = 0;
};

/// Reopens tiles; the result is aligned with the requests, which come sorted.
using PolylineSource =
    std::function<std::vector<std::vector<ArcPoint>>(std::span<const ArcRequest>)>;

struct Assembly {
  CellComplex cells;
  std::uint64_t spaced_vertices = 0;
};

/// Turns a skeleton whose faces are all disks into polygons. `side`: the cells' side in the fixed
/// point of lengths. Throws InternalError if a face is no disk.
Assembly assemble(Skeleton& skeleton, double side, const PolylineSource& polylines);

}  // namespace rattan::layout
