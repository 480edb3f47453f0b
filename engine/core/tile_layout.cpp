// SPDX-License-Identifier: MIT
#include "engine/core/tile_layout.h"

#include <algorithm>

namespace rattan {

TileId TileLayout::owner(std::uint64_t id) const {
  const auto after =
      std::upper_bound(tiles.begin(), tiles.end(), id,
                       [](std::uint64_t v, const TileExtent& t) { return v < t.first; });
  return TileId(static_cast<std::uint32_t>(after - tiles.begin() - 1));
}

void connect_halos(TileLayout& layout, const std::vector<std::vector<std::uint64_t>>& halo_ids,
                   std::vector<std::vector<std::uint32_t>>& border,
                   std::vector<std::vector<std::uint32_t>>& halo_slots) {
  const std::size_t n = layout.tiles.size();
  border.assign(n, {});
  halo_slots.assign(n, {});
  for (std::size_t t = 0; t < n; ++t) {
    layout.tiles[t].halo = static_cast<std::uint32_t>(halo_ids[t].size());
    for (const std::uint64_t id : halo_ids[t]) {
      const std::uint32_t o = layout.owner(id).value;
      border[o].push_back(static_cast<std::uint32_t>(id - layout.tiles[o].first));
    }
  }
  std::uint64_t next = 0;
  for (std::size_t t = 0; t < n; ++t) {
    std::sort(border[t].begin(), border[t].end());
    border[t].erase(std::unique(border[t].begin(), border[t].end()), border[t].end());
    layout.tiles[t].border_first = next;
    layout.tiles[t].border = static_cast<std::uint32_t>(border[t].size());
    next += border[t].size();
  }
  layout.border_count = next;
  for (std::size_t t = 0; t < n; ++t) {
    halo_slots[t].reserve(halo_ids[t].size());
    for (const std::uint64_t id : halo_ids[t]) {
      const std::uint32_t o = layout.owner(id).value;
      const auto local = static_cast<std::uint32_t>(id - layout.tiles[o].first);
      const auto at = std::lower_bound(border[o].begin(), border[o].end(), local);
      halo_slots[t].push_back(
          static_cast<std::uint32_t>(layout.tiles[o].border_first + (at - border[o].begin())));
    }
  }
}

}  // namespace rattan
