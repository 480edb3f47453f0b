// SPDX-License-Identifier: MIT
#pragma once

// A disk being mapped to a square, and when the map is good enough.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "engine/core/types.h"

namespace rattan::layout {

struct FlatDisk {
  std::vector<Vec3d> position;
  std::vector<std::array<std::uint32_t, 3>> triangle;
  std::vector<std::uint8_t> fixed;  ///< one a vertex: 1 on the rim
  std::vector<Vec2d> uv;            ///< one a vertex; the rim's lie on the sides of [0, size]^2
  double size = 1;
  /// Vertices from `given` on were made: half-way between two earlier ones.
  std::uint32_t given = 0;
  std::vector<std::array<std::uint32_t, 2>> made;
};

/// Twice the signed area of a flat triangle.
inline double doubled_area(const Vec2d& a, const Vec2d& b, const Vec2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

/// Its three sides, each measured as |du| + |dv|.
inline double girth(const Vec2d& a, const Vec2d& b, const Vec2d& c) {
  return (b - a).lpNorm<1>() + (c - b).lpNorm<1>() + (a - c).lpNorm<1>();
}

/// 2 area / girth: up to sqrt 2 below the radius of the inscribed circle, negative if folded.
/// Moving each coordinate by up to d changes the doubled area by d girth + 6 d^2 at most, so a
/// triangle thicker than d can't fold by it (girths being far above 6 d).
inline double thickness(const Vec2d& a, const Vec2d& b, const Vec2d& c) {
  const double around = girth(a, b, c);
  return around > 0 ? doubled_area(a, b, c) / around : 0;
}

/// The floor, in units: twice the change by rounding to a grid of 2^-14. A triangle as thick is
/// larger than 8 times its square.
inline constexpr double kLeastThickness = 1.0 / 16384;

inline double thickness(const FlatDisk& disk, std::uint32_t t) {
  const std::array<std::uint32_t, 3>& c = disk.triangle[t];
  return thickness(disk.uv[c[0]], disk.uv[c[1]], disk.uv[c[2]]);
}

inline std::uint32_t count_thin(const FlatDisk& disk) {
  std::uint32_t count = 0;
  for (std::uint32_t t = 0; t < disk.triangle.size(); ++t) {
    count += thickness(disk, t) >= kLeastThickness ? 0 : 1;
  }
  return count;
}

inline bool same_side(const FlatDisk& disk, std::uint32_t a, std::uint32_t b) {
  const Vec2d& p = disk.uv[a];
  const Vec2d& q = disk.uv[b];
  return (p.x() == q.x() && (p.x() == 0 || p.x() == disk.size)) ||
         (p.y() == q.y() && (p.y() == 0 || p.y() == disk.size));
}

enum class Chords : std::uint8_t {
  kNeeded,  ///< those within one side, and those of thin triangles
  kAll,
};

/// Puts a vertex in the middle of edges inside the disk that join two rim vertices. Triangles with
/// three rim vertices whose shape nothing else can change are what makes others needed.
void split_chords(FlatDisk& disk, Chords which);

/// Moves inside vertices, one at a time, away from the folded and thin triangles around them: no
/// further than gives twice the floor, where this can be. Returns how many were moved. What it
/// leaves thin is never thinner than before. Does nothing where much of the map is thin.
std::uint32_t nudge_thin(FlatDisk& disk);

}  // namespace rattan::layout
