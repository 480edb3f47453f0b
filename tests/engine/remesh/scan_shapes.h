// SPDX-License-Identifier: MIT
#pragma once

// Small scans and remeshes built in code.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "engine/remesh/polygon_mesh.h"
#include "engine/remesh/triangle_index.h"

namespace rattan::test {

struct Soup {
  std::vector<Vec3d> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// From a point to the nearest triangle, tried one by one.
inline double distance_to(const Soup& scan, const Vec3d& p) {
  double best = 1e300;
  for (const auto& t : scan.triangles) {
    best = std::min(best, closest_on_triangle(p, scan.positions[t[0]], scan.positions[t[1]],
                                              scan.positions[t[2]])
                              .distance2);
  }
  return std::sqrt(best);
}

/// A grid of nu x nv cells over [0, 1]^2 mapped by f, each cell two triangles, in row order.
inline Soup grid_scan(std::uint32_t nu, std::uint32_t nv,
                      const std::function<Vec3d(double, double)>& f) {
  Soup s;
  for (std::uint32_t j = 0; j <= nv; ++j) {
    for (std::uint32_t i = 0; i <= nu; ++i) {
      // Rounded as the store rounds, so that tests may compare with the surface as stored.
      s.positions.push_back(f(double(i) / nu, double(j) / nv).cast<float>().cast<double>());
    }
  }
  const auto at = [&](std::uint32_t i, std::uint32_t j) { return j * (nu + 1) + i; };
  for (std::uint32_t j = 0; j < nv; ++j) {
    for (std::uint32_t i = 0; i < nu; ++i) {
      s.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      s.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return s;
}

/// The cube [-1, 1]^3 with n x n cells a side, mapped by f; closed, shared vertices merged.
struct CubeSurface {
  std::vector<Vec3d> positions;
  std::vector<std::array<std::uint32_t, 4>> quads;
};
CubeSurface cube_surface(std::uint32_t n, const std::function<Vec3d(const Vec3d&)>& f);
Soup cube_scan(std::uint32_t n, const std::function<Vec3d(const Vec3d&)>& f);
PolygonMesh cube_remesh(std::uint32_t n, const std::function<Vec3d(const Vec3d&)>& f);

/// nu x nv quads over [0, 1]^2 mapped by f.
PolygonMesh grid_remesh(std::uint32_t nu, std::uint32_t nv,
                        const std::function<Vec3d(double, double)>& f);

/// Reproducible numbers in [-1, 1).
class Noise {
 public:
  explicit Noise(std::uint64_t seed) : state_(seed * 2 + 1) {}
  double operator()() {
    state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(state_ >> 33) / static_cast<double>(1ULL << 30) - 1.0;
  }
  Vec3d vector() {
    const double x = (*this)();
    const double y = (*this)();
    return {x, y, (*this)()};
  }

 private:
  std::uint64_t state_;
};

}  // namespace rattan::test
