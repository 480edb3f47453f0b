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

/// (K . e, K_perp . e) at a vertex. Normals of vertices on creases belong to neither side, so that
/// what lies across the curve is foreshortened there: it is restored from the length of `e`.
inline Vec2d frame_parts(const VertexFrame& f, const Vec3d& k, const Vec3d& perp, const Vec3d& e) {
  Vec2d parts(k.dot(e), perp.dot(e));
  if (f.pins == kPinTheta || f.pins == kPinPhi) {
    const int across = f.pins == kPinTheta ? 0 : 1;
    const double length2 = e.squaredNorm();
    const double along2 = parts[1 - across] * parts[1 - across];
    if (along2 < 0.9 * length2) {
      const double whole = std::sqrt(length2 - along2);
      parts[across] = parts[across] >= 0.0 ? whole : -whole;
    }
  }
  return parts;
}

/// `omega`: the period, a length. Call with i the lower global id; reverse() gives the other way.
/// At corners K means nothing: the other end speaks for both.
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
  const Vec3d e = (j.position.cast<double>() - i.position.cast<double>());
  const double f = exact::kPi / omega;
  if ((i.pins | j.pins) == 0) {
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
    g.delta = f * (static_cast<double>(i.scale) * k_i + static_cast<double>(j.scale) * k).dot(e);
    g.delta_perp =
        f * (static_cast<double>(i.scale) * perp_i + static_cast<double>(j.scale) * k_perp).dot(e);
    return g;
  }
  const Vec2d near = static_cast<double>(i.scale) * frame_parts(i, k_i, perp_i, e);
  Vec2d far = static_cast<double>(j.scale) * frame_parts(j, k_j, perp_j, e);
  if (g.r == 1) {
    far = Vec2d(far.y(), -far.x());
  } else if (g.r == 2) {
    far = -far;
  } else if (g.r == 3) {
    far = Vec2d(-far.y(), far.x());
  }
  const bool only_far = i.pins == kPinBoth && j.pins != kPinBoth;
  const bool only_near = j.pins == kPinBoth && i.pins != kPinBoth;
  const Vec2d sum = only_far ? Vec2d(2.0 * far) : (only_near ? Vec2d(2.0 * near) : near + far);
  g.delta = f * sum.x();
  g.delta_perp = f * sum.y();
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
