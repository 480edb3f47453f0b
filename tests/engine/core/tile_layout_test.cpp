// SPDX-License-Identifier: MIT
#include "engine/core/tile_layout.h"

#include <gtest/gtest.h>

namespace rattan {
namespace {

TEST(TileLayout, HaloValuesComeFromTheirOwners) {
  TileLayout layout;
  layout.node_count = 10;
  layout.tiles = {{.first = 0, .owned = 4}, {.first = 4, .owned = 3}, {.first = 7, .owned = 3}};
  const std::vector<std::vector<std::uint64_t>> halo = {{4, 9}, {0, 3, 7}, {5, 6}};
  std::vector<std::vector<std::uint32_t>> border;
  std::vector<std::vector<std::uint32_t>> slots;
  connect_halos(layout, halo, border, slots);
  EXPECT_EQ(layout.owner(3), TileId(0));
  EXPECT_EQ(layout.owner(4), TileId(1));
  EXPECT_EQ(layout.owner(9), TileId(2));

  HaloBoard<std::uint64_t> board(layout.border_count);
  std::vector<std::vector<std::uint64_t>> owned(3);
  for (std::size_t t = 0; t < 3; ++t) {
    for (std::uint32_t v = 0; v < layout.tiles[t].owned; ++v) {
      owned[t].push_back(100 + layout.tiles[t].first + v);
    }
    publish_border<std::uint64_t>(owned[t], border[t], layout.tiles[t].border_first, board);
  }
  for (std::size_t t = 0; t < 3; ++t) {
    const auto local = with_halo<std::uint64_t>(owned[t], slots[t], board);
    ASSERT_EQ(local.size(), owned[t].size() + halo[t].size());
    for (std::size_t k = 0; k < halo[t].size(); ++k) {
      EXPECT_EQ(local[owned[t].size() + k], 100 + halo[t][k]);
    }
  }
}

}  // namespace
}  // namespace rattan
