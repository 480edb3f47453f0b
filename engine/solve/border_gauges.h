// SPDX-License-Identifier: MIT
#pragma once

// Gauges of border nodes, found in the pass that assembles a periodic system: what its coarsening
// would need a pass of its own for.

#include <vector>

#include "engine/solve/block_ops.h"
#include "engine/solve/hierarchy.h"

namespace rattan {

/// Carries a value from the gauge of node i's parent to its own, by the strongest edges along the
/// tree.
template <class Block>
Coefficient<Block> gauge_along(std::span<const std::uint32_t> tree,
                               std::span<const std::uint32_t> row_begin,
                               std::span<const std::uint32_t> neighbor,
                               std::span<const Coefficient<Block>> coefficient, std::uint32_t i) {
  using Ops = BlockOps<Block>;
  Coefficient<Block> g = Ops::identity();
  if constexpr (Ops::kPeriodic) {
    while (tree[i] != i) {
      const std::uint32_t toward = tree[i];
      float best = -1.0F;
      Coefficient<Block> step = Ops::identity();
      for (std::uint32_t e = row_begin[i]; e < row_begin[i + 1]; ++e) {
        if (neighbor[e] == toward && Ops::magnitude2(coefficient[e]) > best) {
          best = Ops::magnitude2(coefficient[e]);
          step = coefficient[e];
        }
      }
      g = Ops::compose(g, Ops::unit_of(step));
      i = toward;
    }
  }
  return g;
}

template <class Block>
class BorderGauges {
 public:
  /// One tile's part of an assembling pass.
  struct Tile {
    ChunkView<std::uint32_t> tree, border;
    std::vector<Coefficient<Block>> gauges;
  };

  explicit BorderGauges(const Hierarchy& hierarchy) : level_(hierarchy.levels.front()) {
    if (!level_.coarsest()) {
      board_.resize(level_.layout.border_count);
    }
  }
  void load(TileId id, Tile& tile) const {
    if (!level_.coarsest()) {
      tile.tree = read(*level_.store, level_.tree, id);
      tile.border = read(*level_.store, level_.halo.border, id);
    }
  }
  static void compute(std::span<const std::uint32_t> row_begin,
                      std::span<const std::uint32_t> neighbor,
                      std::span<const Coefficient<Block>> coefficient, Tile& tile) {
    for (const std::uint32_t b : tile.border) {
      tile.gauges.push_back(
          gauge_along<Block>(tile.tree.span(), row_begin, neighbor, coefficient, b));
    }
  }
  void commit(TileId id, const Tile& tile) {
    std::copy(
        tile.gauges.begin(), tile.gauges.end(),
        board_.begin() + static_cast<std::ptrdiff_t>(level_.layout.tiles[id.value].border_first));
  }
  HaloBoard<Coefficient<Block>> take() { return std::move(board_); }

 private:
  const Level& level_;
  HaloBoard<Coefficient<Block>> board_;
};

}  // namespace rattan
