// SPDX-License-Identifier: MIT
#include "engine/remesh/shape_pull.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>

namespace rattan {

namespace {

// Triangles aren't among what the figures count, but flat ones spoil their neighbours.
constexpr double kTriangleWeight = 0.5;
constexpr double kTriangleEdge = 1.1;
// Keeps all corners of a face in play, and the weights apart from 0 / 0 where all are right.
constexpr double kLeastWeight = 0.05;
constexpr double kShortest = 1e-3;  // of the edge length

struct Corners {
  std::array<double, kPullMaxCorners> cosine{};  ///< of the turn, less that of the right turn
  std::array<double, kPullMaxCorners> weight{};
};

/// Turns run from the last edge into the next, 90 degrees in a square.
Corners measure(std::span<const Vec3d> along, const Vec3d& normal) {
  const std::size_t n = along.size();
  Corners corners;
  double sum = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    const Vec3d& last = along[k == 0 ? n - 1 : k - 1];
    const double c = last.dot(along[k]);
    if (n == 3) {
      corners.cosine[k] = c + 0.5;
      corners.weight[k] = kTriangleWeight;
      continue;
    }
    double off = 1.0;  // 1 - the sine
    corners.cosine[k] = c < 0.0 ? -1.0 : 1.0;
    if (normal.dot(last.cross(along[k])) >= 0.0) {
      off -= std::sqrt(std::max(0.0, 1.0 - c * c));
      corners.cosine[k] = c;
    }
    corners.weight[k] = off;
    sum += off * off;
  }
  if (n == 4) {
    const double scale = 1.0 / (std::sqrt(sum) + 1e-9);
    for (double& w : corners.weight) {
      w = std::max(w * scale, kLeastWeight);
    }
  }
  return corners;
}

}  // namespace

void pull_face(std::span<const Vec3d> positions, std::span<const std::uint32_t> face,
               const Vec3d& normal, double edge_length, double length_weight, ShapePull* out) {
  const std::size_t n = face.size();
  std::fill_n(out, n, ShapePull{});
  if (n > kPullMaxCorners) {
    return;
  }
  std::array<Vec3d, kPullMaxCorners> along;
  std::array<Vec3d, kPullMaxCorners> across;  // leftwards
  std::array<double, kPullMaxCorners> inverse{};
  std::array<double, kPullMaxCorners> stretch{};
  for (std::size_t k = 0; k < n; ++k) {
    along[k] = positions[face[k + 1 == n ? 0 : k + 1]] - positions[face[k]];
    const double length = std::max(along[k].norm(), kShortest * edge_length);
    along[k] /= length;
    inverse[k] = edge_length / length;
    stretch[k] = length / edge_length - (n == 3 ? kTriangleEdge : 1.0);
    across[k] = inverse[k] * normal.cross(along[k]);
  }
  const Corners corners = measure({along.data(), n}, normal);
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t last = k == 0 ? n - 1 : k - 1;
    const std::size_t next = k + 1 == n ? 0 : k + 1;
    // The turn grows as the vertices before and after move left of their edges.
    const double w = corners.weight[k];
    const Vec3d ahead = (w * corners.cosine[k]) * across[k];
    const Vec3d behind = (w * corners.cosine[k]) * across[last];
    const double stiff_ahead = w * inverse[k] * inverse[k];
    const double stiff_behind = w * inverse[last] * inverse[last];
    const Vec3d shorten = (length_weight * stretch[k]) * along[k];
    out[next].force += ahead - shorten;
    out[last].force += behind;
    out[k].force += shorten - ahead - behind;
    out[next].stiffness += stiff_ahead + length_weight;
    out[last].stiffness += stiff_behind;
    out[k].stiffness += stiff_ahead + stiff_behind + length_weight;
  }
  for (std::size_t k = 0; k < n; ++k) {
    out[k].force *= edge_length;
  }
}

}  // namespace rattan
