// SPDX-License-Identifier: MIT
#pragma once

// The remesh at every stage from the arrangement's polygons to quads: of output size, in memory.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/types.h"
#include "engine/mesh/scan_sink.h"

namespace rattan {

/// Faces of any degree over shared vertices. Oriented like the scan.
struct PolygonMesh {
  std::vector<Vec3d> positions;              ///< relative to ScanMesh::origin
  std::vector<std::uint64_t> face_begin{0};  ///< faces + 1 offsets into corners
  std::vector<std::uint32_t> corners;        ///< vertex of each corner, counter-clockwise
  /// Optional, one a vertex: scan triangle (global id) nearest to the vertex when it was made; a
  /// starting point for projection.
  std::vector<std::uint64_t> scan_triangle;
  /// Optional, one a vertex: kBoundaryVertex, kCornerVertex, ...
  std::vector<std::uint8_t> vertex_flags;
  /// Optional, one a vertex; set on the finished mesh (transfer_colours).
  std::vector<Rgba> colours;

  /// Edges that follow features inside the scan (its boundary edges are known without): kept by all
  /// that changes faces. Each pair ascending.
  std::vector<std::array<std::uint32_t, 2>> feature_edges;

  /// Whether any colour is not opaque.
  bool has_alpha() const {
    for (const Rgba& c : colours) {
      if (c[3] != 255) {
        return true;
      }
    }
    return false;
  }
  std::size_t vertex_count() const { return positions.size(); }
  std::size_t face_count() const { return face_begin.size() - 1; }
  std::size_t degree(std::size_t face) const { return face_begin[face + 1] - face_begin[face]; }
  std::span<const std::uint32_t> face(std::size_t f) const {
    return {corners.data() + face_begin[f], degree(f)};
  }
  std::span<std::uint32_t> face(std::size_t f) {
    return {corners.data() + face_begin[f], degree(f)};
  }
  void add_face(std::span<const std::uint32_t> vertices) {
    corners.insert(corners.end(), vertices.begin(), vertices.end());
    face_begin.push_back(corners.size());
  }
};

inline constexpr std::uint8_t kBoundaryVertex = 1;
/// A corner of a boundary loop or feature curve; must keep its position.
inline constexpr std::uint8_t kCornerVertex = 2;
inline constexpr std::uint8_t kFeatureVertex = 4;

}  // namespace rattan
