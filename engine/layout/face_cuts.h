// SPDX-License-Identifier: MIT
#pragma once

// Cutting faces that are not disks until they are, along pieces of scan edges and lines that were
// dropped. A tree-cotree decomposition with shortest paths to the face's border; closed components
// without any line are first divided among a few well-spread seeds.

#include <array>
#include <compare>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/layout/graph_keys.h"
#include "engine/layout/tile_graph.h"

namespace rattan::layout {

struct CellKey {
  std::uint64_t triangle = 0;  ///< global
  std::uint32_t index = 0;     ///< within the triangle
  friend auto operator<=>(const CellKey&, const CellKey&) = default;
};

/// A part of the arrangement inside a face that is off the graph: a piece of a scan edge, or a
/// stretch of a dropped line.
struct FaceSegment {
  PointKey key;  ///< pieces by edge; stretches {kInTriangle | triangle, 1, i}
  std::array<PointKey, 2> ends;
  std::array<bool, 2> on_graph{};  ///< as far as the tile knows
  std::array<CellKey, 2> cells;
  std::uint32_t cell_count = 0;  ///< 1 on the tile's rim
  std::uint32_t face = 0;        ///< local face, later the stitched one
  std::uint32_t tile = 0;
  double length = 0.0;

  bool is_piece() const { return !key.in_triangle(); }
};

/// Lists what lies inside the wanted local faces. `arc_alive`: one an arc of the tile's graph;
/// `loose`: pieces of features on rims of tiles that were peeled off, sorted.
std::vector<FaceSegment> face_segments(const TileArrangement& a, const TracedTile& traced,
                                       std::span<const std::uint8_t> wanted_faces,
                                       std::span<const std::uint8_t> arc_alive,
                                       std::span<const PointKey> loose);

struct FaceCut {
  PointKey piece;
  std::vector<std::uint32_t> tiles;  ///< those that see the piece
};

/// `segments` of all tiles, `face` stitched, `on_graph` complete; `bare`: one a stitched face, set
/// for closed components without graph. Returns the pieces to cut, ascending.
std::vector<FaceCut> cut_faces(std::vector<FaceSegment> segments,
                               std::span<const std::uint8_t> bare);

}  // namespace rattan::layout
