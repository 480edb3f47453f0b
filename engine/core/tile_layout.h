// SPDX-License-Identifier: MIT
#pragma once

// Which tile owns what, and where the values of its halo come from. The same description serves the
// vertices of the scan and the nodes of every coarser level of the hierarchy.

#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/store.h"
#include "engine/core/types.h"

namespace rattan {

/// Nodes [first, first + owned) of the level belong to this tile. Local numbers: owned nodes first,
/// then the halo in ascending global order.
struct TileExtent {
  std::uint64_t first = 0;
  std::uint32_t owned = 0;
  std::uint32_t halo = 0;
  /// Slots [border_first, border_first + border) of the halo board hold this tile's border nodes:
  /// those owned nodes that some other tile has in its halo, ascending.
  std::uint64_t border_first = 0;
  std::uint32_t border = 0;
};

/// Small (32 bytes a tile), always in memory.
struct TileLayout {
  std::vector<TileExtent> tiles;
  std::uint64_t node_count = 0;
  std::uint64_t border_count = 0;

  std::uint32_t tile_count() const { return static_cast<std::uint32_t>(tiles.size()); }
  /// Tile that owns global node `id`; O(log tiles).
  TileId owner(std::uint64_t id) const;
};

/// Names of the per-tile arrays that connect a layout's halo: "mesh/..." for the scan, others for
/// coarser levels.
struct HaloFields {
  Field<std::uint64_t> halo_ids;    ///< `halo` global ids, ascending
  Field<std::uint32_t> halo_slots;  ///< `halo` slots of the board, aligned with halo_ids
  Field<std::uint32_t> border;      ///< `border` local numbers of owned nodes, ascending
};

/// Fills owned-independent parts: given each tile's extents (first, owned) and sorted halo ids,
/// finds border lists and slots, sets halo/border counts in the layout. Deterministic.
void connect_halos(TileLayout& layout, const std::vector<std::vector<std::uint64_t>>& halo_ids,
                   std::vector<std::vector<std::uint32_t>>& border,
                   std::vector<std::vector<std::uint32_t>>& halo_slots);

/// The values of all border nodes: about 5 % of the level. A pass reads one board and publishes
/// into another, so its result doesn't depend on the order in which tiles run.
template <class T>
using HaloBoard = std::vector<T>;

/// The board of a finished field is kept as the chunk of this tile number.
inline constexpr TileId kBoardTile{0xffffffffU};

/// owned values + halo values from the board, in local order.
template <class T>
std::vector<T> with_halo(std::span<const T> owned, std::span<const std::uint32_t> halo_slots,
                         const HaloBoard<T>& board) {
  std::vector<T> local;
  local.reserve(owned.size() + halo_slots.size());
  local.assign(owned.begin(), owned.end());
  for (const std::uint32_t slot : halo_slots) {
    local.push_back(board[slot]);
  }
  return local;
}

/// Publishes this tile's border values.
template <class T>
void publish_border(std::span<const T> owned, std::span<const std::uint32_t> border,
                    std::uint64_t border_first, HaloBoard<T>& board) {
  for (std::size_t k = 0; k < border.size(); ++k) {
    board[border_first + k] = owned[border[k]];
  }
}

/// Local values (owned then halo) of a finished field whose board was stored under kBoardTile.
template <class T>
std::vector<T> read_local(Store& store, Field<T> field, const HaloFields& halo, TileId tile) {
  const ChunkView<T> owned = read(store, field, tile);
  const ChunkView<T> board = read(store, field, kBoardTile);
  const ChunkView<std::uint32_t> slots = read(store, halo.halo_slots, tile);
  std::vector<T> local;
  local.reserve(owned.size() + slots.size());
  local.assign(owned.begin(), owned.end());
  for (const std::uint32_t slot : slots) {
    local.push_back(board[slot]);
  }
  return local;
}

}  // namespace rattan
