// SPDX-License-Identifier: MIT
#pragma once

// From a chart cut out of the scan to one with coordinates (PGP 3.4).

#include "engine/layout/chart_graph.h"
#include "engine/layout/chart_mesh.h"
#include "engine/layout/divide_sides.h"

namespace rattan {

struct FlattenOptions {
  /// Coordinates along strands to take instead of computing them.
  layout::GivenParameters given;
};

/// Unfolds the chart if its coordinates are there and do, else flattens it if it has four sides,
/// else splits it. Vertices keep their order: the chart's, the divisions of its strands, those made
/// inside. Every triangle is as thick as kLeastThickness (flat_disk.h), but for those counted as
/// `thin`; none is folded. Coordinates on the rim are multiples of layout::kRimGrid and, up to
/// quarter turns and whole numbers, the same in both charts beside a strand; those along the
/// geodesics of a split chart the same in both parts. Throws InternalError unless `mesh` is a disk
/// with the sides that `graph` says. The same result from any thread.
FlatChart flatten_chart(ChartMesh&& mesh, const ChartGraph& graph,
                        const FlattenOptions& options = {});

}  // namespace rattan
