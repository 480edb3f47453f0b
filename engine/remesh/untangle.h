// SPDX-License-Identifier: MIT
#pragma once

// Positions around folded and flat quads, where the even steps of optimise.h and the search for one
// vertex at a time end in a dead end.

#include <cstdint>

#include "engine/core/task_graph.h"
#include "engine/remesh/boundary_curve.h"
#include "engine/remesh/polygon_mesh.h"
#include "engine/remesh/surface_projector.h"

namespace rattan {

class FeatureSet;

struct UntangleOptions {
  /// Quads of at most this scaled Jacobian (see quality.h) are bad.
  double least = 0.03;
  /// A patch is let alone as soon as all its quads have more than this.
  double enough = 0.3;
  /// Zero: vertices on boundaries and creases slide along them, corners stay. Else they may leave
  /// them, at a cost of this much for the square of each edge length; 1 holds them weakly.
  double leash = 0.0;
  /// Faces may look anywhere, even into the solid.
  bool any_way = false;
  /// For vertices on the scan's boundary; null: they stay where they are.
  const BoundaryCurve* boundary = nullptr;
  /// For vertices on creases; null: none of them is on one.
  const FeatureSet* features = nullptr;
};

struct UntangleReport {
  std::uint64_t bad_before = 0;
  std::uint64_t bad_after = 0;
  std::uint64_t patches = 0;   ///< of bad quads that share vertices to move
  std::uint64_t improved = 0;  ///< of these, with fewer bad quads now or better ones
};

/// Moves vertices near bad quads so that as few as possible stay bad, and makes their faces as
/// square as that allows. A patch where that
/// doesn't help is left as it is. Sets scan_triangle of what moves. The mesh must be manifold, of
/// triangles and quads, and oriented like the scan. Same result for any number of threads and any
/// tile size.
UntangleReport untangle(PolygonMesh& mesh, SurfaceProjector& projector,
                        const UntangleOptions& options, TaskGraph& graph);

}  // namespace rattan
