// SPDX-License-Identifier: MIT
#pragma once

// A low-passed copy of the positions, on which fields and phases are solved: relief much smaller
// than a quad must not bend the lines.

#include "engine/core/task_graph.h"
#include "engine/field/field_data.h"
#include "engine/mesh/features.h"

namespace rattan {

struct LowPassOptions {
  /// Root mean square reach of the filter, a length; 0 copies the positions.
  double radius = 0.0;
  /// Vertices on its curves move along them only, corners stay; may be null.
  const FeatureSet* features = nullptr;
};

/// The reach that `wanted` (a length) is cut down to, so that thin parts keep their girth: a few
/// edges are enough against noise however coarse the remesh.
double capped_low_pass_radius(const ScanMesh& mesh, double wanted);

/// Applies S (2 - S), S = (1 + t L)^-1 with L the area-normalised Laplacian and t = radius^2 / 4:
/// flat to second order in the pass band, where S alone would shrink a tube of radius R by t / R^2.
/// Vertices of the boundary and of feature curves move along these only, by their own Laplacian.
/// Solved by Gauss-Seidel within tiles, halos from the pass before. Needs the vertex graph; writes
/// kSmoothPosition with its board.
void low_pass_positions(Store& store, const ScanMesh& mesh, const LowPassOptions& options,
                        TaskGraph& tasks);

}  // namespace rattan
