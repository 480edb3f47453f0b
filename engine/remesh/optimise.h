// SPDX-License-Identifier: MIT
#pragma once

// Vertex positions of the remesh, optimised on the scan: even squares first, closeness last.

#include <cstdint>

#include "engine/core/store.h"
#include "engine/core/task_graph.h"
#include "engine/mesh/tile_mesh.h"
#include "engine/remesh/polygon_mesh.h"
#include "engine/remesh/surface_projector.h"

namespace rattan {

class FeatureSet;

struct OptimiseOptions {
  /// Steps of shape matching: every vertex moves towards the corners of the regular polygons that
  /// fit its faces best.
  int steps = 40;
  /// Share of the last step's movement carried into the next; 40 steps at 0.9 do the work of 250
  /// without.
  double momentum = 0.9;
  /// Of the way to the mean of those corners; stable below 2 (1 + momentum).
  double step_length = 2.0;
  /// True projections onto the scan (one or two passes over the tiles each) come every so many
  /// steps of either kind and at the end; between them a vertex slides in its tangent plane, turned
  /// every other step.
  int steps_per_projection = 20;
  /// 0 leaves each polygon its own size, 1 asks for the mean size of all.
  double size_weight = 0.4;
  /// Steps after those, along the forces of shape_pull.h: they know of the largest corner deviation
  /// of a face and of its edge lengths, where shape matching knows of squares only.
  int pull_steps = 10;
  /// Evenness of edge lengths against that of angles in those steps.
  double length_weight = 0.8;
  /// One round of quadric relocation after the steps; takes vertices off the scan by as much as
  /// brings the faces nearer to it, and a little towards its creases: each length gained there
  /// costs corners and edge lengths.
  bool relocate = true;
  double tangential_weight = 2.0;
  double normal_weight = 0.1;
  /// No step may push the scaled Jacobian of a face below this, nor lower it further, unless the
  /// face is inverted already.
  double least_jacobian = 0.5;
  /// Vertices of feature edges slide along its curves; may be null, else outlives the call.
  const FeatureSet* features = nullptr;
  /// Rounds of local search around faces with a scaled Jacobian of zero or less.
  int untangle_rounds = 4;
};

struct OptimiseReport {
  std::uint64_t steps = 0;            ///< of both kinds
  std::uint64_t projections = 0;      ///< closest points asked for
  std::uint64_t reverted = 0;         ///< vertices put back where a face would have degraded
  std::uint64_t relocated = 0;        ///< vertices moved by their quadric
  std::uint64_t inverted_before = 0;  ///< faces with a scaled Jacobian of zero or less
  std::uint64_t inverted_after = 0;
};

/// Moves vertices only; sets scan_triangle to the nearest triangle of each vertex (used as a hint
/// on entry where present). Vertices with an edge of one face stay on the scan's boundary, those
/// inside chains of feature edges on their curve; vertices flagged kCornerVertex stay where they
/// are, and so do those where features meet. The mesh must be manifold and oriented like the scan.
/// Same result for any number of threads and any tile size.
OptimiseReport optimise(PolygonMesh& remesh, Store& store, const ScanMesh& scan,
                        SurfaceProjector& projector, const OptimiseOptions& options,
                        TaskGraph& graph);

}  // namespace rattan
