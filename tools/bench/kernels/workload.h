// SPDX-License-Identifier: MIT
#pragma once

// What the kernels are measured on: a synthesised scan in memory, taken through the pipeline once
// by one thread.

#include <string>
#include <vector>

#include "engine/core/memory_store.h"
#include "engine/core/task_graph.h"
#include "engine/mesh/tile_mesh.h"
#include "engine/param/parameterize.h"

namespace rattan {

/// Everything that the stages from reading to the phases left in the store; systems are assembled,
/// so that kernels can apply them.
struct Workload {
  explicit Workload(std::uint64_t triangles);

  MemoryStore store;
  TaskGraph tasks{{.threads = 1, .tiles_in_flight = 2}};
  ScanMesh mesh;
  double quad_side = 0.0;
  SurfaceField field;
  std::vector<Vec3f> positions;  ///< of all vertices, in the order of the scan's tiles
};

/// Made at the first call; the size is set before that.
Workload& workload();
void set_workload_triangles(std::uint64_t triangles);

}  // namespace rattan
