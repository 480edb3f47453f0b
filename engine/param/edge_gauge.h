// SPDX-License-Identifier: MIT
#pragma once

// What one edge says about the parameterization: the quarter turns that align the fields of its
// ends, and the phase differences that the fields ask for (PGP 2.4, Algorithm 1; signs as corrected
// there: the edge vector is not normalised). Assembly and extraction both call this, always from
// the lower global vertex to the higher, so that every tile and every triangle agree to the last
// bit.

#include <cmath>
#include <cstdint>

#include "engine/core/exact_math.h"
#include "engine/core/types.h"
#include "engine/field/vertex_frame.h"

namespace rattan {

/// Along i -> j: rotating the frame of j by r quarter turns (r = 1: K_j becomes K_perp_j) aligns it
/// best with that of i; then theta_j' - theta_i should be delta and phi_j' - phi_i delta_perp,
/// where (theta', phi') = (theta, phi), (phi, -theta), (-theta, -phi), (-phi, theta) for r = 0, 1,
/// 2, 3.
struct EdgeGauge {
  std::uint32_t r = 0;
  double delta = 0.0;
  double delta_perp = 0.0;
};

/// `omega`: the period, a length. Call with i the lower global id; reverse() gives the other way.
inline EdgeGauge edge_gauge(const VertexFrame& i, const VertexFrame& j, double omega) {
  const Vec3d n_i = i.normal.cast<double>();
  const Vec3d n_j = j.normal.cast<double>();
  const Vec3d k_i = i.direction.cast<double>();
  const Vec3d k_j = j.direction.cast<double>();
  const Vec3d perp_i = n_i.cross(k_i);
  const Vec3d perp_j = n_j.cross(k_j);
  const double straight = k_i.dot(k_j) + perp_i.dot(perp_j);
  const double turned = k_i.dot(perp_j) - perp_i.dot(k_j);
  EdgeGauge g;
  if (std::abs(straight) >= std::abs(turned)) {
    g.r = straight >= 0.0 ? 0 : 2;
  } else {
    g.r = turned >= 0.0 ? 1 : 3;
  }
  Vec3d k = k_j;
  Vec3d k_perp = perp_j;
  if (g.r == 1) {
    k = perp_j;
    k_perp = -k_j;
  } else if (g.r == 2) {
    k = -k_j;
    k_perp = -perp_j;
  } else if (g.r == 3) {
    k = -perp_j;
    k_perp = k_j;
  }
  const Vec3d e = (j.position.cast<double>() - i.position.cast<double>());
  const double f = exact::kPi / omega;
  g.delta = f * (static_cast<double>(i.scale) * k_i + static_cast<double>(j.scale) * k).dot(e);
  g.delta_perp =
      f * (static_cast<double>(i.scale) * perp_i + static_cast<double>(j.scale) * k_perp).dot(e);
  return g;
}

/// The same edge from j to i.
inline EdgeGauge reverse(const EdgeGauge& g) {
  switch (g.r) {
    case 0:
      return {0, -g.delta, -g.delta_perp};
    case 1:
      return {3, g.delta_perp, -g.delta};
    case 2:
      return {2, g.delta, g.delta_perp};
    default:
      return {1, -g.delta_perp, g.delta};
  }
}

}  // namespace rattan
