// SPDX-License-Identifier: MIT
#pragma once

// What is done to a repaired scan on request only: small components dropped, holes filled. The
// tiles are read as a stream, changed, and ingested again.

#include "engine/core/store.h"
#include "engine/core/task_graph.h"
#include "engine/mesh/ingest.h"
#include "engine/mesh/tile_mesh.h"

namespace rattan {

/// Drops components of fewer than options.drop_components triangles, then fills boundary loops of
/// at most options.fill_holes edges; replaces the tiles and `mesh`, and counts in mesh.repaired. A
/// component of a single triangle is not filled. Beside what ingest takes: 12 bytes a border
/// vertex; to fill holes, 40 bytes a boundary edge. Throws InputError if no component is left.
void refine_scan(Store& store, ScanMesh& mesh, const IngestOptions& options, TaskGraph& graph);

}  // namespace rattan
