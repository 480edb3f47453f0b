// SPDX-License-Identifier: MIT
#pragma once

// Boundary loops of the remesh brought within a tolerance of the scan's, by vertices where the
// scan's loops bend. Loops that zigzag with the triangles of the scan are left alone.

#include <cstdint>
#include <vector>

#include "engine/remesh/boundary_curve.h"
#include "engine/remesh/polygon_mesh.h"

namespace rattan {

/// The scan's boundary loops as polygons. Immutable; about 24 bytes a boundary vertex.
class BoundaryLoops {
 public:
  /// `all`: loops that zigzag count as smooth too, as they are meant.
  BoundaryLoops(const BoundaryCurve& curve, bool all);

  std::size_t size() const { return corners_.size(); }
  /// In order, the surface on the left.
  const std::vector<Vec3d>& corners(std::size_t loop) const { return corners_[loop]; }
  double length(std::size_t loop) const { return length_[loop]; }
  /// It doesn't zigzag: it bends gently, or sharply at few places; or all loops count.
  bool is_smooth(std::size_t loop) const { return smooth_[loop] != 0; }
  /// It zigzags and counts all the same: its corners are where its shape is.
  bool is_ragged(std::size_t loop) const { return ragged_[loop] != 0; }

 private:
  std::vector<std::vector<Vec3d>> corners_;
  std::vector<double> length_;
  std::vector<std::uint8_t> smooth_;
  std::vector<std::uint8_t> ragged_;
};

/// For loops of the scan shorter than `longest`, and ragged ones of not too many corners, on which
/// the remesh has but a few vertices: gives them the fewest vertices that keep the loop within
/// `tolerance` (a length) both ways, but not fewer than they have, moves the latter there, flags
/// all of them kCornerVertex (to stay), and splits the faces beside them. Returns the number of
/// vertices added. Needs a simple mesh, leaves one of triangles and quads.
std::uint64_t reshape_short_loops(PolygonMesh& mesh, const BoundaryCurve& curve,
                                  const BoundaryLoops& loops, double longest, double tolerance);

/// Faces with all edges but one on the boundary that lie folded over a hole are joined to their
/// neighbours, which are split anew. Returns how many. Needs a simple mesh of triangles and quads,
/// leaves one.
std::uint64_t unfold_ears(PolygonMesh& mesh);

/// Divides edges of the boundary that leave a smooth loop by more than `tolerance` where the loop
/// is farthest, and splits the faces beside them. Returns the number of vertices added. Needs a
/// simple mesh, leaves one of triangles and quads.
std::uint64_t refine_loops(PolygonMesh& mesh, const BoundaryCurve& curve,
                           const BoundaryLoops& loops, double tolerance);

}  // namespace rattan
