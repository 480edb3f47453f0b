// SPDX-License-Identifier: MIT
#include "engine/remesh/vertex_motion.h"

namespace rattan {

VertexMotions vertex_motions(const PolygonMesh& mesh, const VertexStars& stars,
                             const BoundaryCurve* boundary, const CreaseVertices& creases,
                             bool hold_curves) {
  const std::size_t n = mesh.vertex_count();
  VertexMotions out{std::vector<Motion>(n, Motion::kFree), std::vector<std::uint32_t>(n, 0)};
  for (std::uint32_t v = 0; v < n; ++v) {
    if (stars.begin[v] == stars.begin[v + 1] ||
        (!mesh.vertex_flags.empty() && (mesh.vertex_flags[v] & kCornerVertex) != 0) ||
        (hold_curves && (stars.on_boundary[v] != 0 || creases.degree[v] > 0))) {
      out.motion[v] = Motion::kFixed;
    } else if (stars.on_boundary[v] != 0) {
      const bool path =
          stars.boundary[v][0] != kNoVertex && boundary != nullptr && !boundary->empty();
      out.motion[v] = path ? Motion::kBoundary : Motion::kFixed;
      if (path) {
        out.loop[v] = boundary->closest(mesh.positions[v]).loop;
      }
    } else if (creases.degree[v] > 0) {
      out.motion[v] = creases.curve[v] == kNoCurve ? Motion::kFixed : Motion::kAlongCrease;
    }
  }
  return out;
}

}  // namespace rattan
