// SPDX-License-Identifier: MIT
#pragma once

// A strip of triangles between two vertices of a chart, and the shortest path within it.

#include <array>
#include <vector>

#include "engine/layout/cut_mesh.h"

namespace rattan::layout {

/// The edges a path crosses, one after the other. No triangle occurs twice; the first alone has the
/// start as a corner, the last alone the end. Without edges: start and end are neighbours.
struct Sleeve {
  std::vector<HalfedgeHandle> crossed;  ///< triangles on the left before, on the right after
  std::vector<double> share;            ///< where, along crossed
  /// Between which shares: apart from walls; equal ones hold the path at a vertex.
  std::vector<std::array<double, 2>> gate;
  double length = 0;              ///< of the path
  std::vector<std::size_t> bend;  ///< edges at whose ends the path bends for want of room
};

/// Strings pulled tight in strips of triangles.
class SleevePaths {
 public:
  SleevePaths(const CutMesh& mesh, VertexHandle from, VertexHandle to);

  /// Drops what makes a chain of neighbouring triangles no sleeve: loops, and what lies before the
  /// last triangle at the start and behind the first at the end. Shortens any path. Shares stay
  /// with their edges. Clears `gate`.
  void tidy(Sleeve& s);
  /// Widest gates.
  void open_gates(Sleeve& s) const;
  /// Sets share, length and bend: the shortest path through the gates, unfolded.
  void pull(Sleeve& s);
  /// Sets length.
  void measure(Sleeve& s) const;
  /// The sleeve that passes the vertex where `s` bends on the other side; false if that is a wall.
  /// Gates are open, nothing is pulled.
  bool flip(const Sleeve& s, std::size_t bend, Sleeve& flipped);

 private:
  void unfold(const Sleeve& s);
  void funnel(const Sleeve& s);

  const CutMesh* mesh_;
  VertexHandle from_, to_;
  std::vector<int> place_;                   ///< one a triangle: where in the sleeve, or -1
  Vec2d start_, end_;                        ///< unfolded, as is what follows
  std::vector<std::array<Vec2d, 2>> ends_;   ///< of the edges: from, to
  std::vector<std::array<Vec2d, 2>> gates_;  ///< right, left
  struct Corner {
    std::size_t gate = 0;
    Vec2d point;
    int end = 0;  ///< 0: right, 1: left
  };
  std::vector<Corner> corners_;  ///< of the path, start and end included
};

}  // namespace rattan::layout
