// SPDX-License-Identifier: MIT
#pragma once

// The cheapest way to divide one polygon into quads and triangles by diagonals, by dynamic
// programming over its corners.

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "engine/core/types.h"

namespace rattan {

/// Polygons above this are to be divided beforehand: the work grows with the fourth power.
inline constexpr std::size_t kSplitMaxCorners = 40;

/// The polygon in order, counter-clockwise seen against the normals.
struct PolygonCorners {
  std::vector<std::uint32_t> vertex;  ///< ids; may repeat
  std::vector<Vec3d> position;
  std::vector<Vec3d> normal;  ///< unit, or zero where unknown
  /// corners x corners, row-major, used for row < column: 1 where the diagonal must not be used
  /// because the mesh has an edge between the two vertices (or they are the same vertex).
  std::vector<std::uint8_t> forbidden;
  /// What a diagonal costs (or gains) at each of its ends besides the shape of the pieces; empty
  /// for nothing. Chooses between splits, and isn't part of PolygonSplit::cost.
  std::vector<double> bias;
  /// 1 where the vertex will stay where it is, so that a flat or acute corner of a quad will too;
  /// empty for nowhere.
  std::vector<std::uint8_t> firm;

  std::size_t size() const { return vertex.size(); }
};

struct PolygonSplit {
  bool feasible = false;
  double cost = 0;
  std::vector<std::pair<std::uint32_t, std::uint32_t>>
      diagonals;  ///< corner numbers, first < second
  /// When set, the polygon (of even degree) is divided by a centre vertex joined to every second
  /// corner, from corner 0 or 1; diagonals is empty.
  int star = -1;
};

/// Cost of one piece: 0.5 sum (angle error)^2 + 0.25 log^2 aspect (quads), + 1.5 per triangle, plus
/// penalties for reflex corners, for firm ones far from 90 degrees, and for normals that disagree
/// with the surface.
class PolygonSplitter {
 public:
  static constexpr double kTriangle = 1.5;

  /// Pieces never repeat a vertex. `quads_only` allows no triangle (even degrees); `stars` allows a
  /// centre vertex. At most kSplitMaxCorners corners, at least three.
  PolygonSplit split(const PolygonCorners& polygon, bool quads_only, bool stars);
  /// The cost of leaving a triangle or a quad as it is.
  double cost(const PolygonCorners& polygon);

 private:
  void prepare(const PolygonCorners& polygon);
  double corner_angle(std::size_t at, std::size_t before, std::size_t after) const;
  double quad_angle_cost(std::size_t at, double angle) const;
  double triangle_cost(std::size_t i, std::size_t k, std::size_t j) const;
  double quad_cost(std::size_t i, std::size_t k, std::size_t l, std::size_t j) const;
  double star_cost(std::size_t first) const;
  void collect(std::size_t i, std::size_t j, PolygonSplit& split) const;

  const PolygonCorners* polygon_ = nullptr;
  std::size_t n_ = 0;
  Vec3d normal_ = Vec3d::Zero();
  std::vector<Vec3d> normals_;
  std::vector<double> bearing_, length_, best_;
  std::vector<std::array<std::uint8_t, 2>> choice_;
};

}  // namespace rattan
