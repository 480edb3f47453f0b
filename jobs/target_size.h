// SPDX-License-Identifier: MIT
#pragma once

#include "engine/mesh/tile_mesh.h"
#include "jobs/remesh_options.h"

namespace rattan {

/// What the user asked for, in the two forms that the pipeline needs.
struct TargetSize {
  double faces = 0.0;
  double quad_side = 0.0;  ///< length; sqrt(area / faces)
};

/// The faces that the largest of the sizes asks of a scan with so many triangles; 0 where the area
/// decides, or the triangles, if 0 says that they aren't known yet.
double asked_faces(const RemeshOptions& options, std::uint64_t triangles);

TargetSize target_size(SizeKind kind, double size, const ScanMesh& mesh);

/// Whether `faces` meets the target within the promised 15 %.
bool meets_target(double faces, const TargetSize& target);

}  // namespace rattan
