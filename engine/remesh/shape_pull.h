// SPDX-License-Identifier: MIT
#pragma once

// The forces of the figures that a quad mesh is judged by: the least sine of each face's corners,
// and the variation of edge lengths.

#include <cstdint>
#include <span>

#include "engine/core/types.h"

namespace rattan {

/// Of one face on one of its vertices; force / stiffness is a length.
struct ShapePull {
  Vec3d force = Vec3d::Zero();
  double stiffness = 0.0;
};

/// Faces of more corners feel no force.
inline constexpr std::size_t kPullMaxCorners = 4;

/// The force on each corner of a face is -edge_length^2 times the gradient of
///   sqrt(sum over its corners of (1 - cos d)^2)
///   + length_weight / 2 * sum over its edges of (l / edge_length - 1)^2.
/// d is a corner's deviation from 90 degrees and 1 - cos d what the scaled Jacobian would lose by
/// it; the root of squares leans to the worst corner, which is the one that counts. Corners whose
/// share in it is small weigh a little more than that. Corners that are reflex against `normal`
/// (unit) feel the force of those of 180 degrees. Triangles have 60 degrees for a right angle,
/// slightly longer edges, and the plain sum of squares. One entry of `out` a corner.
void pull_face(std::span<const Vec3d> positions, std::span<const std::uint32_t> face,
               const Vec3d& normal, double edge_length, double length_weight, ShapePull* out);

}  // namespace rattan
