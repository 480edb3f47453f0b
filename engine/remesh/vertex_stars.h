// SPDX-License-Identifier: MIT
#pragma once

// Which corners meet at each vertex of a polygon mesh, and its neighbours along the boundary.

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "engine/remesh/polygon_mesh.h"

namespace rattan {

inline constexpr std::uint32_t kNoVertex = std::numeric_limits<std::uint32_t>::max();

struct VertexStars {
  std::vector<std::uint32_t> begin;   ///< vertices + 1 offsets into corner and face
  std::vector<std::uint32_t> corner;  ///< index into PolygonMesh::corners, ascending
  std::vector<std::uint32_t> face;    ///< face of that corner
  /// Previous and next vertex along the boundary, kNoVertex twice for interior vertices and for
  /// vertices where the boundary isn't one path.
  std::vector<std::array<std::uint32_t, 2>> boundary;
  /// One a vertex: it has an edge with one face.
  std::vector<std::uint8_t> on_boundary;

  explicit VertexStars(const PolygonMesh& mesh);
  std::span<const std::uint32_t> faces(std::uint32_t v) const {
    return {face.data() + begin[v], begin[v + 1] - begin[v]};
  }
};

/// Taken off the quality of polygons that face away.
inline constexpr double kFacingAway = 4.0;

/// The least sine over the corners of a polygon, measured against its mean normal: the scaled
/// Jacobian of a quad. -1 if the polygon is degenerate; less by kFacingAway if it faces away from
/// `reference` (unit or zero).
double corner_quality(std::span<const Vec3d> positions, std::span<const std::uint32_t> face,
                      const Vec3d& reference);

/// Unit normals, the mean of the normals of the vertex' faces weighted by area.
std::vector<Vec3d> vertex_normals(const PolygonMesh& mesh, const VertexStars& stars);

/// Mean over all edges, each counted once per face it bounds.
double mean_edge_length(const PolygonMesh& mesh);

}  // namespace rattan
