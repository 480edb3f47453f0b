// SPDX-License-Identifier: MIT
#pragma once

// What the field stages keep in the store, per owned vertex, each with its halo board.

#include <array>

#include "engine/field/vertex_frame.h"
#include "engine/mesh/halo_view.h"
#include "engine/mesh/vertex_graph.h"

namespace rattan {

/// The normal-cycle measure of a neighbourhood (Cohen-Steiner and Morvan 2003): sum over edges of
/// dihedral angle times length times the edge's direction dyad, and the neighbourhood's area.
/// Additive, of any common scale: curvature is measure / area.
struct CurvatureMeasure {
  /// xx, yy, zz, xy, xz, yz, area, 0.
  std::array<float, 8> m{};
};

namespace fields {
/// Low-passed positions, relative to the scan's origin.
inline constexpr Field<Vec3f> kSmoothPosition{"geometry/position"};
/// Unit normals of the low-passed surface.
inline constexpr Field<Vec3f> kNormal{"geometry/normal"};
/// A third of the area of the low-passed triangles around the vertex. No board.
inline constexpr Field<float> kVertexArea{"geometry/area"};
inline constexpr Field<CurvatureMeasure> kCurvature{"field/curvature"};
}  // namespace fields

}  // namespace rattan
