// SPDX-License-Identifier: MIT
#pragma once

// From repaired blocks to tiles: final numbers of the halo, the order of triangles, boundaries.

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "engine/core/tile_layout.h"
#include "engine/core/types.h"
#include "engine/mesh/patches.h"
#include "engine/mesh/repair.h"
#include "engine/mesh/scan_sink.h"

namespace rattan {

/// Everything that other blocks must know of one: about 5 % of the vertices, in memory, in board
/// order (slots).
struct BorderTable {
  std::vector<std::uint32_t> rank;    ///< relative to the block's first rank
  std::vector<std::uint32_t> vertex;  ///< repaired number relative to the tile's first
  std::vector<Vec3f> position;
  std::vector<Rgba> colour;        ///< empty: none
  std::vector<SplitCorner> split;  ///< ascending; `copy` is a slot here
};

/// One repaired block as the second pass sees it; see BlockRepair for the arrays.
struct TileInput {
  std::uint32_t tile = 0;
  std::span<const LocalTriangle> triangles;
  std::uint32_t home = 0;
  std::span<const std::uint64_t> foreign;
  std::span<const std::uint32_t> source;
  std::span<const std::uint32_t> patch_of;
  std::span<const PatchFate> fates;  ///< of the block's border patches
  std::span<const Vec3f> ranked_positions;
  std::span<const Rgba> ranked_colours;  ///< empty: none
};

/// Contents of one tile's chunks, and what it adds to the sums over the mesh.
struct TileArrays {
  std::vector<Vec3f> positions;
  std::vector<Rgba> colours;
  std::vector<LocalTriangle> triangles;
  std::vector<std::uint8_t> flags;
  std::vector<std::uint64_t> halo_ids;
  std::vector<std::uint32_t> halo_slots;

  std::uint64_t flipped_triangles = 0;
  std::uint64_t boundary_edges = 0;  ///< those that leave an owned vertex
  std::uint64_t closed_loops = 0;    ///< boundary loops inside the tile
  /// Pieces of boundary that reach other tiles: (a vertex of the piece, a vertex it shares).
  std::vector<std::pair<std::uint64_t, std::uint64_t>> open_loops;
  double area = 0.0;              ///< of owned triangles
  double side_length = 0.0;       ///< of all sides of owned triangles
  Vec3f box_min = Vec3f::Zero();  ///< of owned vertices
  Vec3f box_max = Vec3f::Zero();
};

/// `layout` holds first, owned and border of every tile; `block_size` ranks a tile.
TileArrays build_tile(const TileInput& input, const TileLayout& layout, const BorderTable& border,
                      std::uint64_t block_size);

/// Number of loops that the pieces of all tiles form.
std::uint64_t count_open_loops(const std::vector<std::pair<std::uint64_t, std::uint64_t>>& pieces);

}  // namespace rattan
