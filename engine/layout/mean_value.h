// SPDX-License-Identifier: MIT
#pragma once

// Convex combination maps: each inside vertex at a weighted mean of its neighbours, with positive
// weights, the rim fixed. One-to-one if the rim is convex and no inside edge joins two vertices of
// one side (Tutte 1963, Floater 1997).

#include <cstdint>
#include <span>
#include <vector>

#include "engine/layout/elimination.h"
#include "engine/layout/flat_disk.h"

namespace rattan::layout {

/// The parts of a mean value weight: tan of half the angle between two edges that leave a vertex,
/// and an edge's length in parts of the longest there. Within bounds, so that triangles without
/// area do no harm.
double half_tangent(const Vec3d& a, const Vec3d& b);
double relative_length(const Vec3d& edge, double longest);

/// What stretch is measured against.
enum class Reference : std::uint8_t {
  kSurface,      ///< the triangles on the surface
  kEquilateral,  ///< equal ones, whatever lies on the surface
};

class ConvexMap {
 public:
  /// Mean value weights, (tan(a / 2) + tan(b / 2)) / length with the angles beside the edge
  /// (Floater 2003).
  explicit ConvexMap(const FlatDisk& disk);

  /// Equal weights instead.
  void use_equal_weights();
  /// Divides weights by the stretch around the neighbour, so that vertices draw away from where the
  /// map is small (Yoshizawa et al. 2004). Still positive.
  void reweight(const FlatDisk& disk, Reference reference);
  /// Puts the inside vertices in place. Without inside vertices nothing is done. False, and nothing
  /// done, if weights have become too uneven for numbers.
  bool solve(std::span<Vec2d> value);

 private:
  void scale_rows();

  std::vector<std::uint32_t> row_of_;  ///< one a vertex; none for the rim
  std::vector<std::uint32_t> vertex_;  ///< one a row
  std::vector<std::uint32_t> begin_;   ///< rows + 1, into neighbours
  std::vector<std::uint32_t> neighbour_;
  std::vector<double> weight_;         ///< a row sums to 1
  std::vector<std::uint32_t> inside_;  ///< of neighbour_, those inside too: what elimination_ knows
  Elimination elimination_;
  std::vector<Vec2d> found_;
};

/// Root mean square of the singular values of the way back onto the surface (Sander et al. 2001),
/// over the surface; areas of flat triangles are taken as some least value at least.
double mean_stretch(const FlatDisk& disk);

}  // namespace rattan::layout
