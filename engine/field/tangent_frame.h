// SPDX-License-Identifier: MIT
#pragma once

// Tangent frames in closed form, and how directions travel between them.

#include <cmath>
#include <complex>
#include <cstdint>

#include "engine/core/types.h"

namespace rattan {

using Complexd = std::complex<double>;

/// Right-handed: x cross y is the normal.
struct TangentFrame {
  Vec3d x;
  Vec3d y;
};

/// A frame that depends on the unit normal alone, so that nobody stores it. Smooth but at one pole,
/// where it jumps by a rotation; nothing depends on its choice.
inline TangentFrame tangent_frame(const Vec3d& n) {
  const double s = n.z() < 0.0 ? -1.0 : 1.0;
  const double a = -1.0 / (s + n.z());
  const double b = n.x() * n.y() * a;
  return {{1.0 + s * n.x() * n.x() * a, s * b, -s * n.x()}, {b, s + n.y() * n.y() * a, -n.y()}};
}

/// e^{i beta} such that a direction at angle alpha in frame j, carried to i by the shortest
/// rotation between the normals, stands at angle alpha + beta in frame i. (The two sums are 1 + n_i
/// . n_j times cosine and sine.) transport(j, i) is the exact conjugate. 1 where the normals are
/// opposite.
inline Complexd transport(const TangentFrame& i, const TangentFrame& j) {
  const double c = i.x.dot(j.x) + i.y.dot(j.y);
  const double s = i.y.dot(j.x) - i.x.dot(j.y);
  const double norm = std::sqrt(c * c + s * s);
  return norm > 1e-12 ? Complexd(c / norm, s / norm) : Complexd(1.0, 0.0);
}

/// z^n for n = 1, 2, 4.
inline Complexd symmetry_power(Complexd z, int n) {
  for (; n > 1; n /= 2) {
    z = {z.real() * z.real() - z.imag() * z.imag(), 2.0 * z.real() * z.imag()};
  }
  return z;
}

/// The n-th root nearest to 1 of a unit complex number, n = 1, 2, 4, by half-angle formulas alone.
inline Complexd symmetry_root(Complexd z, int n) {
  for (; n > 1; n /= 2) {
    if (z.real() >= 0.0) {
      const double c = std::sqrt(0.5 * (1.0 + z.real()));
      z = {c, z.imag() / (2.0 * c)};
    } else {
      const double s = std::sqrt(0.5 * (1.0 - z.real()));
      z = z.imag() >= 0.0 ? Complexd(z.imag() / (2.0 * s), s) : Complexd(-z.imag() / (2.0 * s), -s);
    }
  }
  return z;
}

/// z / |z|, or `otherwise` where |z| is too small to have a direction.
inline Complexd unit_or(Complexd z, Complexd otherwise) {
  const double norm = std::sqrt(z.real() * z.real() + z.imag() * z.imag());
  return norm > 1e-30 ? Complexd(z.real() / norm, z.imag() / norm) : otherwise;
}

}  // namespace rattan
