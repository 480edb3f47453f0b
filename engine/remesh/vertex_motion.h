// SPDX-License-Identifier: MIT
#pragma once

// What each vertex of a remesh may do when positions are improved.

#include <cstdint>
#include <vector>

#include "engine/remesh/boundary_curve.h"
#include "engine/remesh/crease_curve.h"
#include "engine/remesh/polygon_mesh.h"
#include "engine/remesh/vertex_stars.h"

namespace rattan {

enum class Motion : std::uint8_t {
  kFree,         ///< anywhere on the scan
  kBoundary,     ///< along its boundary loop
  kAlongCrease,  ///< along its curve
  kFixed,
};

struct VertexMotions {
  std::vector<Motion> motion;       ///< one a vertex
  std::vector<std::uint32_t> loop;  ///< of BoundaryCurve, where the motion is kBoundary
};

/// Corners stay where they are, and so do vertices where features or boundaries meet and those
/// without a face. `boundary`: null to hold vertices on boundaries. `hold_curves`: all vertices on
/// curves do.
VertexMotions vertex_motions(const PolygonMesh& mesh, const VertexStars& stars,
                             const BoundaryCurve* boundary, const CreaseVertices& creases,
                             bool hold_curves);

}  // namespace rattan
