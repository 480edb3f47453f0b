// SPDX-License-Identifier: MIT
#pragma once

// How good a quad-dominant mesh is, in the usual figures.

#include <cstdint>
#include <span>
#include <vector>

#include "engine/remesh/polygon_mesh.h"

namespace rattan {

struct MeshQuality {
  std::uint64_t quads = 0;
  std::uint64_t triangles = 0;
  double quad_share = 0;  ///< quads / faces; 0 without faces
  std::uint64_t interior_vertices = 0;
  std::uint64_t irregular_vertices = 0;  ///< interior, valence other than 4
  double mean_scaled_jacobian = 0;       ///< over quads
  double min_scaled_jacobian = 0;        ///< over quads; 0 without quads
  std::uint64_t bad_quads = 0;           ///< scaled Jacobian <= 0
  double mean_corner_deviation = 0;      ///< degrees from 90, over corners of quads
  double mean_edge_length = 0;
  double edge_length_variation = 0;  ///< standard deviation / mean
  /// Distortion of the map that makes each quad from the same square (of its middle: halves of
  /// opposite sides added). The L2 stretch of Sander et al., relative to a map that keeps all areas
  /// equal and square: at least 1; 0 without quads.
  double stretch = 0;
  double shear = 0;  ///< mean of |cos| between the middle lines of a quad, 0 to 1
};

/// The smallest over the corners of sin(angle), signed by the quad's normal (the cross product of
/// its diagonals): 1 for a rectangle, <= 0 if a corner is reflex, flat or degenerate.
double scaled_jacobian(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d);

/// Faces of four corners whose scaled Jacobian does not exceed `least`, ascending.
std::vector<std::uint32_t> quads_not_above(const PolygonMesh& mesh, double least);

/// Faces of three and four corners of a manifold mesh. Sums run in a fixed order.
MeshQuality measure_quality(const PolygonMesh& mesh);

}  // namespace rattan
