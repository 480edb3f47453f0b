// SPDX-License-Identifier: MIT
// The sequence in a triangle is Roberts' R2 (additive, by the powers of the inverse of the plastic
// number), folded along the diagonal of the unit square.
#include "engine/remesh/surface_samples.h"

#include <cmath>

#include <Eigen/Geometry>

namespace rattan {

namespace {

/// A fixed seed: comparisons of the same files always give the same figures.
constexpr std::uint64_t kSeed = 0x7261747461'6eULL;

/// The finaliser of SplitMix64.
std::uint64_t mixed(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// In [0, 1): the upper 53 bits.
double unit(std::uint64_t x) {
  return static_cast<double>(x >> 11) * 0x1p-53;
}

double fraction(double x) {
  return x - std::floor(x);
}

}  // namespace

double triangle_area(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  return 0.5 * (b - a).cross(c - a).norm();
}

double sample_density(std::uint64_t samples, double area) {
  const double density = area > 0.0 ? static_cast<double>(samples) / area : 0.0;
  return std::isfinite(density) ? density : 0.0;
}

void sample_triangle(std::uint64_t number, const Vec3d& a, const Vec3d& b, const Vec3d& c,
                     double density, std::vector<Vec3d>& points) {
  constexpr double kStepU = 0.7548776662466927;
  constexpr double kStepV = 0.5698402909980532;
  const std::uint64_t first = mixed(kSeed + 3 * number);
  const double wanted = density * triangle_area(a, b, c) + unit(first);
  const auto count = static_cast<std::uint64_t>(wanted);
  if (count == 0) {
    return;
  }
  const double start_u = unit(mixed(kSeed + 3 * number + 1));
  const double start_v = unit(mixed(kSeed + 3 * number + 2));
  for (std::uint64_t k = 0; k < count; ++k) {
    double u = fraction(start_u + static_cast<double>(k) * kStepU);
    double v = fraction(start_v + static_cast<double>(k) * kStepV);
    if (u + v > 1.0) {
      u = 1.0 - u;
      v = 1.0 - v;
    }
    points.push_back(a + u * (b - a) + v * (c - a));
  }
}

}  // namespace rattan
