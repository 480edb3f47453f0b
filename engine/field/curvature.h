// SPDX-License-Identifier: MIT
#pragma once

// Weights, normals, areas and curvature of the low-passed surface: what all later stages share.

#include "engine/core/task_graph.h"
#include "engine/field/field_data.h"
#include "engine/solve/hierarchy.h"

namespace rattan {

struct GeometryOptions {
  EdgeEnergy energy = EdgeEnergy::kTriangle;
  /// Rounds of averaging of the curvature measure over vertex and neighbours; the reach grows with
  /// the square root: about sqrt(rounds) edges.
  int curvature_rounds = 3;
  bool operator==(const GeometryOptions&) const = default;
};

/// Rounds that average over about half of `reach` (a length) around each vertex.
int curvature_rounds(const ScanMesh& mesh, double reach);

/// One pass for weights, normals (area-weighted), areas and raw curvature, then one a round, six at
/// most. Needs the vertex graph and kSmoothPosition; writes kEdgeWeight, kDiagonal, kNormal,
/// kVertexArea, kCurvature. The first round also turns normals that point against their
/// neighbours'. Returns the area of the low-passed surface. `matching`: where the hierarchy can
/// start from.
double prepare_surface(Store& store, const ScanMesh& mesh, const GeometryOptions& options,
                       TaskGraph& tasks, FirstMatching* matching = nullptr);

/// Principal directions in the plane of a tangent frame.
struct PrincipalDirections {
  /// e^{2 i alpha}, alpha the angle of the direction of largest absolute curvature; 0 if undefined.
  std::complex<double> doubled{0.0, 0.0};
  double k1 = 0.0;  ///< larger absolute curvature, 1/length; positive where the surface is convex
  double k2 = 0.0;
  /// (k1-k2)^2 / (2 (k1^2 + k2^2) + floor^2), in [0, 1]: how much the direction deserves trust.
  double fidelity = 0.0;
};

/// `floor_curvature`: below this, 1/length, a surface counts as flat. Eigenvectors of the normal
/// cycle are swapped with respect to the shape operator: an edge of a cylinder along its axis
/// carries the curvature across it.
PrincipalDirections principal_directions(const CurvatureMeasure& measure, const Vec3d& frame_x,
                                         const Vec3d& frame_y, double floor_curvature);

}  // namespace rattan
