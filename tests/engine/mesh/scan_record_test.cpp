// SPDX-License-Identifier: MIT
#include "engine/mesh/scan_record.h"

#include <gtest/gtest.h>

#include "engine/core/memory_store.h"

namespace rattan {
namespace {

TEST(ScanRecord, ComesBackWhole) {
  MemoryStore store;
  std::vector<Vec3d> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (std::uint32_t i = 0; i < 30; ++i) {
    positions.emplace_back(i / 2, i % 2, 0.125 * i);
    if (i >= 2) {
      triangles.push_back(i % 2 == 0 ? std::array{i - 2, i, i - 1} : std::array{i - 2, i - 1, i});
    }
  }
  ScanMesh mesh = tile_indexed_mesh(store, positions, triangles, 7);
  mesh.origin = Vec3d(1e6, -2.5, 3);
  mesh.unit = 0.25;
  mesh.has_colours = true;
  std::uint64_t count = 0;
  for_each_count(mesh.repaired, [&](const char*, std::uint64_t& c) { c = ++count; });
  save_scan_mesh(store, mesh);
  const ScanMesh loaded = load_scan_mesh(store);
  EXPECT_EQ(loaded.origin, mesh.origin);
  EXPECT_EQ(loaded.box_min, mesh.box_min);
  EXPECT_EQ(loaded.box_max, mesh.box_max);
  EXPECT_EQ(loaded.area, mesh.area);
  EXPECT_EQ(loaded.mean_edge_length, mesh.mean_edge_length);
  EXPECT_EQ(loaded.topology.vertices, mesh.topology.vertices);
  EXPECT_EQ(loaded.topology.euler(), 1);
  EXPECT_EQ(loaded.topology.components, 1U);
  EXPECT_EQ(loaded.topology.boundary_loops, 1U);
  EXPECT_EQ(loaded.unit, 0.25);
  EXPECT_TRUE(loaded.has_colours);
  for_each_count(loaded.repaired, [&](const char* name, std::uint64_t c) {
    EXPECT_EQ(c, count + 1 - sizeof(RepairCounts) / sizeof(std::uint64_t)) << name;
    ++count;
  });
  EXPECT_EQ(loaded.layout.node_count, mesh.layout.node_count);
  EXPECT_EQ(loaded.layout.border_count, mesh.layout.border_count);
  ASSERT_EQ(loaded.layout.tiles.size(), mesh.layout.tiles.size());
  for (std::size_t t = 0; t < mesh.layout.tiles.size(); ++t) {
    EXPECT_EQ(loaded.layout.tiles[t].first, mesh.layout.tiles[t].first);
    EXPECT_EQ(loaded.layout.tiles[t].owned, mesh.layout.tiles[t].owned);
    EXPECT_EQ(loaded.layout.tiles[t].halo, mesh.layout.tiles[t].halo);
    EXPECT_EQ(loaded.layout.tiles[t].border_first, mesh.layout.tiles[t].border_first);
    EXPECT_EQ(loaded.layout.tiles[t].border, mesh.layout.tiles[t].border);
    EXPECT_EQ(loaded.triangles[t].first, mesh.triangles[t].first);
    EXPECT_EQ(loaded.triangles[t].owned, mesh.triangles[t].owned);
    EXPECT_EQ(loaded.triangles[t].touching, mesh.triangles[t].touching);
  }
}

TEST(ScanRecord, OfAnotherVersionIsRefused) {
  MemoryStore store;
  write(store, fields::kScanRecord, TileId(0), std::vector<std::uint64_t>{99});
  EXPECT_THROW(load_scan_mesh(store), InternalError);
}

}  // namespace
}  // namespace rattan
