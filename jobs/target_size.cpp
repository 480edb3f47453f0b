// SPDX-License-Identifier: MIT
#include "jobs/target_size.h"

#include <algorithm>
#include <cmath>

namespace rattan {

TargetSize target_size(const RemeshOptions& options, const ScanMesh& mesh) {
  // A scan without area still needs some length to divide by.
  const double least = std::max(mesh.diagonal(), 1e-30);
  const double area = std::max(mesh.area, 1e-12 * least * least);
  TargetSize target;
  switch (options.size_kind) {
    case SizeKind::kFaces:
      target.faces = options.size;
      break;
    case SizeKind::kRatio:
      target.faces = options.size * static_cast<double>(mesh.topology.triangles);
      break;
    case SizeKind::kEdgeLength:
      target.faces = area / (options.size * options.size);
      break;
  }
  target.faces = std::max(target.faces, 1.0);
  target.quad_side = std::sqrt(area / target.faces);
  return target;
}

bool meets_target(double faces, const TargetSize& target) {
  return std::abs(faces - target.faces) <= 0.15 * target.faces;
}

}  // namespace rattan
