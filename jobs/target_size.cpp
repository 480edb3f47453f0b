// SPDX-License-Identifier: MIT
#include "jobs/target_size.h"

#include <algorithm>
#include <cmath>

namespace rattan {

double asked_faces(const RemeshOptions& options, std::uint64_t triangles) {
  const double most = *std::max_element(options.sizes.begin(), options.sizes.end());
  switch (options.size_kind) {
    case SizeKind::kFaces:
      return most;
    case SizeKind::kRatio:
      return most * static_cast<double>(triangles);
    case SizeKind::kEdgeLength:
      break;
  }
  return 0.0;
}

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
      target.faces = area * (mesh.unit / size) * (mesh.unit / size);
      break;
  }
  target.faces = std::max(target.faces, 1.0);
  target.quad_side = std::sqrt(area / target.faces);
  // A scan of needles has hardly any area for its length, and lines so close together would cross
  // it millions of times. What is asked for is then searched from the coarse side.
  const auto triangles = static_cast<double>(mesh.topology.triangles);
  const double length = mesh.mean_edge_length * static_cast<double>(mesh.topology.edges);
  const double most_crossings = 1e3 + 20.0 * (triangles + target.faces);
  target.quad_side = std::max(target.quad_side, 1.3 * length / most_crossings);
  return target;
}

bool meets_target(double faces, const TargetSize& target) {
  return std::abs(faces - target.faces) <= 0.15 * target.faces;
}

}  // namespace rattan
