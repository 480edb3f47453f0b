// SPDX-License-Identifier: MIT
#pragma once

// Distances between scan and remesh, both ways.

#include <cstdint>

#include "engine/core/store.h"
#include "engine/core/task_graph.h"
#include "engine/mesh/tile_mesh.h"
#include "engine/remesh/polygon_mesh.h"
#include "engine/remesh/surface_projector.h"

namespace rattan {

struct DistanceOptions {
  /// Measure every k-th vertex of the scan, by global number; 1 measures all.
  std::uint32_t scan_stride = 1;
};

/// All lengths in units of the file.
struct DistanceReport {
  // From the remesh (its vertices and the middles of its faces) to the scan.
  double to_input_max = 0.0;
  double to_input_rms = 0.0;
  double to_input_mean = 0.0;
  // From the scan's vertices to the remesh.
  double from_input_max = 0.0;
  double from_input_rms = 0.0;
  double from_input_mean = 0.0;
  double diagonal = 0.0;  ///< of the scan's box
  std::uint64_t remesh_samples = 0;
  std::uint64_t scan_samples = 0;
  double scan_share = 0.0;  ///< share of the scan's vertices measured
};

/// Exact distances of the samples. Quads count as the two triangles of their shorter diagonal,
/// larger faces as fans. Passes over the tiles: one, and those of one projection.
DistanceReport measure_distances(const PolygonMesh& remesh, Store& store, const ScanMesh& scan,
                                 SurfaceProjector& projector, const DistanceOptions& options,
                                 TaskGraph& graph);

}  // namespace rattan
