// SPDX-License-Identifier: MIT
#pragma once

// The scan's colours on the vertices of the remesh.

#include "engine/core/store.h"
#include "engine/core/task_graph.h"
#include "engine/mesh/tile_mesh.h"
#include "engine/remesh/polygon_mesh.h"
#include "engine/remesh/surface_projector.h"

namespace rattan {

/// Gives every vertex the colour of its closest point on the scan, interpolated over that point's
/// triangle and rounded to the nearest value. Pre: scan.has_colours. remesh.scan_triangle serves as
/// a hint where present. One pass over the tiles beside the projection.
void transfer_colours(PolygonMesh& remesh, Store& store, const ScanMesh& scan,
                      SurfaceProjector& projector, TaskGraph& graph);

}  // namespace rattan
