// SPDX-License-Identifier: MIT
#pragma once

// What the arrangement of iso-lines leaves behind: a decomposition of the scan into disks.

#include <cstdint>
#include <vector>

#include "engine/remesh/polygon_mesh.h"

namespace rattan {

/// The faces of the arrangement as polygons; of output size. A valid combinatorial map, but not yet
/// a simple mesh: faces of one or two corners, loops, multi-edges, faces that meet themselves along
/// an edge, and vertices of valence two all occur. Its Euler characteristic, components and
/// boundary loops are those of the scan.
struct CellComplex {
  PolygonMesh mesh;
  /// One a corner: the edge from that corner's vertex to the next corner's vertex of its face. An
  /// interior edge occurs exactly twice, in opposite directions (perhaps in one face); a boundary
  /// edge occurs once.
  std::vector<std::uint32_t> corner_edge;
  std::uint32_t edge_count = 0;
  /// One an edge: 1 along a feature of the scan. Empty if there are none.
  std::vector<std::uint8_t> edge_feature;
  /// One a face: 1 if a triangle with a field or phase singularity meets the face.
  std::vector<std::uint8_t> face_singular;
};

}  // namespace rattan
