// SPDX-License-Identifier: MIT
#pragma once

// The scan's sharp feature curves as polylines, for vertices on creases to slide along.

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/mesh/features.h"
#include "engine/remesh/polygon_mesh.h"
#include "engine/remesh/triangle_index.h"

namespace rattan {

inline constexpr std::uint32_t kNoCurve = 0xffffffffU;

/// Holds all crease edges (about 60 bytes an edge).
class CreaseCurve {
 public:
  /// `features` may be null: no curves.
  explicit CreaseCurve(const FeatureSet* features);

  bool empty() const { return segments_.empty(); }
  /// The curve (FeatureEdge::curve) nearest to a point; ties go to the lowest edge. Not if empty.
  std::uint32_t nearest_curve(const Vec3d& p) const;
  /// The one curve that runs from one of these points to the other; kNoCurve if there is none or
  /// several do. Ends of curves are exact: corners stay where they are.
  std::uint32_t between(const Vec3d& p, const Vec3d& q) const;
  /// Closest point of one curve.
  Vec3d closest(const Vec3d& p, std::uint32_t curve) const;

 private:
  std::vector<Vec3f> ends_;              ///< two a segment
  std::vector<LocalTriangle> segments_;  ///< as triangles without area
  std::vector<std::uint32_t> curve_;     ///< one a segment
  struct Ends {
    std::array<double, 6> points;  ///< the lower one first
    std::uint32_t curve;
  };
  void list_ends(const FeatureSet& features);

  std::vector<Ends> between_;  ///< one an open curve, ascending
  std::unique_ptr<TriangleIndex> index_;
};

/// Where the vertices of a remesh stand on creases.
struct CreaseVertices {
  /// Its two neighbours along the crease, for vertices inside one; unspecified for others.
  std::vector<std::array<std::uint32_t, 2>> neighbors;
  std::vector<std::uint8_t> degree;  ///< feature edges at the vertex, at most 255
  std::vector<std::uint32_t> curve;  ///< to slide along; kNoCurve unless the degree is two
};

/// From PolygonMesh::feature_edges. Chains of edges between vertices that are corners or of another
/// degree than two lie on the curve between these, else on that which most of their points are
/// nearest to.
CreaseVertices crease_vertices(const PolygonMesh& mesh, const CreaseCurve& creases);

}  // namespace rattan
