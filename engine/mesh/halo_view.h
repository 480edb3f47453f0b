// SPDX-License-Identifier: MIT
#pragma once

// A finished field as one tile sees it: pinned while loading, gathered (owned, then halo) in
// compute, so that the serial loading step of a pass copies nothing.

#include <algorithm>
#include <cstdint>
#include <vector>

#include "engine/core/tile_layout.h"

namespace rattan {

/// Pins a tile's chunk of a field, the field's board and the tile's halo slots.
template <class T>
struct HaloView {
  ChunkView<T> owned;
  ChunkView<T> board;
  ChunkView<std::uint32_t> slots;

  /// The field's board must have been stored under kBoardTile.
  void load(Store& store, Field<T> field, const HaloFields& halo, TileId tile) {
    owned = read(store, field, tile);
    board = read(store, field, kBoardTile);
    slots = read(store, halo.halo_slots, tile);
  }
  /// Owned values followed by halo values.
  std::vector<T> gather() const {
    std::vector<T> local;
    local.reserve(owned.size() + slots.size());
    local.assign(owned.begin(), owned.end());
    const T* values = board.span().data();
    for (const std::uint32_t slot : slots) {
      local.push_back(values[slot]);
    }
    return local;
  }
};

/// Collects the border values of a pass, tile by tile, and stores them as the field's board.
template <class T>
class BoardWriter {
 public:
  BoardWriter(Field<T> field, const TileLayout& layout)
      : field_(field), layout_(&layout), board_(layout.border_count) {}

  /// Call from commit: writes the owned chunk and publishes its border.
  void commit(Store& store, const HaloFields& halo, TileId tile, std::span<const T> owned) {
    const ChunkView<std::uint32_t> border = read(store, halo.border, tile);
    publish_border(owned, border.span(), layout_->tiles[tile.value].border_first, board_);
    write(store, field_, tile, owned);
  }
  void commit(Store& store, const HaloFields& halo, TileId tile, const std::vector<T>& owned) {
    commit(store, halo, tile, std::span<const T>(owned));
  }
  /// Call after the pass.
  void finish(Store& store) { write(store, field_, kBoardTile, board_); }

 private:
  Field<T> field_;
  const TileLayout* layout_;
  HaloBoard<T> board_;
};

}  // namespace rattan
