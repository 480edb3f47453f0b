// SPDX-License-Identifier: MIT
#pragma once

// A chart's rim laid along its sides.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "engine/layout/chart_graph.h"
#include "engine/layout/chart_mesh.h"

namespace rattan::layout {

struct RimVertex {
  std::uint32_t vertex = 0;
  std::uint32_t side = 0;    ///< it is on, or begins if a corner
  double along = 0;          ///< units from the side's start, in [0, units)
  std::uint32_t strand = 0;  ///< likewise
  std::uint32_t place = 0;   ///< in strand_parameters' list
};

/// The values of StrandPoint::at to take for a strand; empty: compute them.
using GivenParameters = std::function<std::span<const double>(std::uint32_t strand)>;

/// Puts the divisions of its strands into the chart, as vertices after all others, and returns its
/// rim, counter-clockwise from the first corner. Of triangles beside divisions new ones come last.
/// Keeps all arrays of the mesh; a step is divided as the side is. Throws InternalError unless the
/// chart is a disk whose sides fit ChartGraph::ring.
std::vector<RimVertex> divide_sides(ChartMesh& mesh, const ChartGraph& graph,
                                    const GivenParameters& given = nullptr);

}  // namespace rattan::layout
