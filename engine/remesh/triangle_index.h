// SPDX-License-Identifier: MIT
#pragma once

// Closest points on a set of triangles held in memory.

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "engine/core/types.h"

namespace rattan {

inline constexpr std::uint64_t kNoTriangle = std::numeric_limits<std::uint64_t>::max();

/// The best candidate so far. Candidates are ordered by (distance2, triangle).
struct ClosestHit {
  double distance2 = std::numeric_limits<double>::infinity();
  std::uint64_t triangle = kNoTriangle;  ///< base + position in the index's list

  bool better(double d2, std::uint64_t id) const {
    return d2 < distance2 || (d2 == distance2 && id < triangle);
  }
};

/// Where the closest point of a triangle lies: point = sum of weights times corners.
struct ClosestOnTriangle {
  Vec3d point;
  std::array<double, 3> weights;
  double distance2;
};

/// Degenerate triangles (segments, points) are fine. Weights are non-negative and sum to one up to
/// rounding; they are exactly 0 and 1 where the closest point is a corner.
ClosestOnTriangle closest_on_triangle(const Vec3d& p, const Vec3d& a, const Vec3d& b,
                                      const Vec3d& c);

/// A hierarchy of boxes over the list as it stands: every eight consecutive triangles make a node,
/// every eight consecutive nodes make one of the next level. Tight when the list is in the order of
/// a space-filling curve, correct in any order. Takes one pass to build (about 20 nanoseconds and
/// 28 bytes a triangle).
class TriangleIndex {
 public:
  /// The spans must outlive the index. `base` is added to positions in the list to get the ids
  /// reported. `labels`, one a triangle or empty, lets queries be confined to one label.
  TriangleIndex(std::span<const Vec3f> positions, std::span<const LocalTriangle> triangles,
                std::uint64_t base = 0, std::span<const std::uint32_t> labels = {});
  TriangleIndex(const TriangleIndex&) = delete;
  TriangleIndex& operator=(const TriangleIndex&) = delete;

  /// Improves `hit` (whose distance2 bounds the search, itself included) by the triangle with the
  /// least (distance2, id). Boxes are culled in single precision with a margin; distances are
  /// compared in double precision. Thread safe.
  void closest(const Vec3d& p, ClosestHit& hit) const;
  /// Likewise among the triangles with that label.
  void closest_labelled(const Vec3d& p, std::uint32_t label, ClosestHit& hit) const;

  /// Improves `hit` by one triangle of the list, e.g. the one found last time.
  void try_triangle(const Vec3d& p, std::uint32_t local, ClosestHit& hit) const;

  ClosestOnTriangle evaluate(const Vec3d& p, std::uint32_t local) const;
  /// Unit normal; zero if the triangle has no area.
  Vec3d normal(std::uint32_t local) const;
  std::span<const LocalTriangle> triangles() const { return triangles_; }
  std::uint64_t base() const { return base_; }
  /// Of the hierarchy; the spans come on top.
  std::uint64_t bytes() const { return nodes_.size() * sizeof(Node); }
  /// Box of all triangles; inverted if there are none.
  const Vec3f& box_min() const { return box_min_; }
  const Vec3f& box_max() const { return box_max_; }

 private:
  /// Boxes of eight children, axis by axis; inverted where there is no child.
  struct Node {
    std::array<std::array<float, 8>, 3> lo;
    std::array<std::array<float, 8>, 3> hi;
  };
  template <class Accept>
  void search(const Vec3d& p, const Accept& accept, ClosestHit& hit) const;

  std::span<const Vec3f> positions_;
  std::span<const LocalTriangle> triangles_;
  std::span<const std::uint32_t> labels_;
  std::uint64_t base_;
  Vec3f box_min_;
  Vec3f box_max_;
  float largest_coordinate_ = 0.0F;
  std::vector<Node> nodes_;                 ///< level by level, triangles' parents first
  std::vector<std::uint32_t> level_begin_;  ///< levels + 1 offsets; the last level is one node
};

}  // namespace rattan
