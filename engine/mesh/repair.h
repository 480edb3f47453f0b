// SPDX-License-Identifier: MIT
#pragma once

// Repair of one block of vertices: duplicates dropped, edges of more than two triangles (or of two
// that cannot be oriented alike) cut open, vertices split until each has one fan. Needs only the
// triangles that touch the block: an edge is judged by all its triangles, which any end point's
// star holds, and a vertex by its star. Corners connected around a vertex across uncut edges share
// a copy of it. Since a copy's fan is oriented consistently, cutting by copies alone leaves each
// edge with one triangle, or two of opposite directions.
//
// Vertices are known by rank: their number along the curve before repair. Block b holds the ranks
// [b * size, (b + 1) * size).

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/types.h"
#include "engine/mesh/patches.h"

namespace rattan {

/// Corners by rank, the lowest first, orientation as in the file. Index: std::uint32_t or uint64_t.
template <class Index>
using RankTriangle = std::array<Index, 3>;

/// Marks a corner of BlockRepair::triangles as foreign: the rest indexes BlockRepair::foreign.
inline constexpr std::uint32_t kForeignCorner = 0x80000000U;
/// BlockRepair::patch_of of triangles in patches that lie inside the block: nothing left to decide.
inline constexpr std::uint32_t kSettledPatch = 0xffffffffU;

template <class Index>
struct RepairInput {
  std::uint32_t block = 0;
  std::uint64_t block_size = 0;
  std::uint32_t owned = 0;                  ///< vertices in the block
  std::vector<RankTriangle<Index>> home;    ///< lowest rank in this block, any order
  std::vector<RankTriangle<Index>> others;  ///< other triangles that touch the block, any order
  /// Second round only: per border patch of the first round, whether its component is one-sided.
  std::span<const PatchFate> fates;
};

/// Which copy of a split vertex a triangle that leaves its block uses.
struct SplitCorner {
  std::uint64_t rank = 0;
  std::uint64_t low = 0;  ///< the triangle's other two ranks
  std::uint64_t high = 0;
  std::uint64_t copy = 0;  ///< number of the copy within the block's border list
};

struct BlockRepair {
  /// Others, then home, each by ascending (lowest, second, highest) rank. Owned corners are numbers
  /// of repaired vertices of the block, the others kForeignCorner + index.
  std::vector<LocalTriangle> triangles;
  std::uint32_t home = 0;
  std::vector<std::uint64_t> foreign;  ///< ranks, ascending
  std::uint32_t vertices = 0;          ///< repaired vertices in the block
  std::vector<std::uint32_t> source;   ///< their vertices before repair; empty: the same
  std::vector<std::uint32_t>
      border;  ///< repaired vertices with triangles that leave the block, ascending
  std::vector<SplitCorner> split_corners;  ///< ascending by (rank, low, high)

  std::vector<Patch> patches;           ///< those that reach the border
  std::vector<std::uint32_t> patch_of;  ///< per triangle: patch << 1 | parity, or kSettledPatch;
                                        ///< empty: all 0 (or all settled if there are no patches)
  std::vector<PatchLink> home_links;    ///< patch numbers are those of the block
  std::vector<PatchLink> other_links;
  std::uint64_t settled_components = 0;

  std::uint64_t duplicate_triangles = 0;
  std::uint64_t non_manifold_edges = 0;
  std::uint64_t split_vertices = 0;
  std::uint64_t isolated_vertices = 0;
  std::uint64_t one_sided_components = 0;  ///< settled ones
  std::uint64_t flipped_triangles = 0;     ///< in settled patches
};

template <class Index>
BlockRepair repair_block(RepairInput<Index> input);

extern template BlockRepair repair_block(RepairInput<std::uint32_t>);
extern template BlockRepair repair_block(RepairInput<std::uint64_t>);

}  // namespace rattan
