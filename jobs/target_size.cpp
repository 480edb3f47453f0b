// SPDX-License-Identifier: MIT
#include "jobs/target_size.h"

#include <algorithm>
#include <cmath>

namespace rattan {

TargetSize target_size(SizeKind kind, double size, const ScanMesh& mesh) {
  // A scan without area still needs some length to divide by.
  const double least = std::max(mesh.diagonal(), 1e-30);
  const double area = std::max(mesh.area, 1e-12 * least * least);
  TargetSize target;
  switch (kind) {
    case SizeKind::kFaces:
      target.faces = size;
      break;
    case SizeKind::kRatio:
      target.faces = size * static_cast<double>(mesh.topology.triangles);
      break;
    case SizeKind::kEdgeLength:
      target.faces = area / (size * size);
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
