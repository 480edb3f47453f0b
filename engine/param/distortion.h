// SPDX-License-Identifier: MIT
#pragma once

// Distortion as in PGP Table I, of the map from parameter space to the surface. Per triangle T of
// area A and parametric area a, with S_u, S_v the derivatives of that map and s, t its singular
// values:
//
//   L2(T)   = sqrt((s^2 + t^2) / 2) = sqrt((|S_u|^2 + |S_v|^2) / 2)   (Sander et al. 2001)
//   shear(T) = |S_u . S_v| / (|S_u| |S_v|),  |cos| of the angle between the iso-lines
//
// and over a surface
//
//   stretch = sqrt(sum A L2^2 / sum A) * sqrt(sum a / sum A),   shear = sum A shear / sum A:
//
// 1 and 0 for an isometry times any uniform scale, the least possible. A few near-degenerate
// triangles at singularities dominate the stretch, so it is also taken over the triangles of least
// L2 that make up 99 % of the area (all four sums over these alone).

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/task_graph.h"
#include "engine/mesh/tile_mesh.h"
#include "engine/param/triangle_coordinates.h"

namespace rattan {

struct TriangleDistortion {
  double area = 0.0;       ///< on the surface
  double parameter = 0.0;  ///< area in parameter space, negative if folded over
  double stretch2 = 0.0;   ///< L2 squared, at most kMostStretch squared
  double shear = 0.0;      ///< in [0, 1]; 1 where an iso-direction vanishes
};

/// L2 counts as this where it is larger or the triangle has no area in parameter space.
inline constexpr double kMostStretch = 1024.0;
/// Share of the area that the trimmed stretch is taken over.
inline constexpr double kTrimmedShare = 0.99;

/// Corners on the surface and in parameter space, where one unit is to be one length: scale
/// parameters first. A triangle without area on the surface counts for nothing (all zero).
TriangleDistortion triangle_distortion(const std::array<Vec3d, 3>& surface,
                                       const std::array<Vec2d, 3>& parameter);

/// Sums over triangles, in any number of parts: about 60 bytes.
struct DistortionTotals {
  double area = 0.0;
  double parameter = 0.0;  ///< of absolute values
  double area_stretch2 = 0.0;
  double area_shear = 0.0;

  void add(const TriangleDistortion& t);
  DistortionTotals& operator+=(const DistortionTotals& o);
  /// 1 and 0 without area.
  double stretch() const;
  double shear() const;
};

/// Likewise, and sorted by stretch into bins of 1.1 % (about 40 KiB), of which the last one needed
/// counts in proportion: what is trimmed is exact to a hundredth of that bin's part. Added and
/// merged in a fixed order the figures are the same to the last bit.
class DistortionSums {
 public:
  DistortionSums();
  void add(const TriangleDistortion& t);
  void add(const std::array<Vec3d, 3>& surface, const std::array<Vec2d, 3>& parameter) {
    add(triangle_distortion(surface, parameter));
  }
  void merge(const DistortionSums& o);

  const DistortionTotals& totals() const { return totals_; }
  double stretch() const { return totals_.stretch(); }
  double shear() const { return totals_.shear(); }
  /// Over the best `share` of the area.
  double stretch_trimmed(double share = kTrimmedShare) const;

 private:
  struct Bin {
    double area = 0.0;
    double parameter = 0.0;
    double area_stretch2 = 0.0;
  };
  DistortionTotals totals_;
  std::vector<Bin> bins_;  ///< ascending by stretch
};

/// theta and phi at the corners of a triangle of the tile's chunk, in the gauge of its first:
/// those of the others by the edges from there, also where the triangle is open.
std::array<PhaseAngles, 3> corner_angles(const TileMesh& mesh, const TileCoordinates& coordinates,
                                         std::uint32_t triangle);

/// Of the triangles that the tile owns, as the solution leaves them, singular ones included.
DistortionSums tile_distortion(const TileMesh& mesh, const TileCoordinates& coordinates,
                               double omega);

/// The whole scan's, on its own positions; reads fields::kFrame and fields::kPhase. One pass.
DistortionSums measure_distortion(Store& store, const ScanMesh& mesh, double omega,
                                  TaskGraph& tasks);

}  // namespace rattan
