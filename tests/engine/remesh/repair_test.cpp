// SPDX-License-Identifier: MIT
#include "engine/remesh/repair.h"

#include <gtest/gtest.h>

#include "tests/engine/remesh/small_maps.h"

namespace rattan {
namespace {

using namespace test;

TEST(Repair, ADoubletMakesOneQuadOfTwo) {
  CellMap map = map_of(mesh_of(5, {{0, 1, 2, 3}, {2, 1, 0, 4}}));
  const CellMap::Counts before = map.counts();
  const RepairReport report = repair(map);
  EXPECT_EQ(report.doublets, 1U);
  EXPECT_EQ(report.insets, 0U);
  EXPECT_EQ(map.counts().faces, 1);
  expect_kept(before, map.to_mesh());
}

TEST(Repair, APillowGetsInsets) {
  CellMap map = map_of(mesh_of(4, {{0, 1, 2, 3}, {3, 2, 1, 0}}));
  const CellMap::Counts before = map.counts();
  EXPECT_GT(repair(map).insets, 0U);
  ASSERT_NO_THROW(map.validate());
  expect_kept(before, map.to_mesh());
}

TEST(Repair, LeavesWhatIsSound) {
  CellMap map = map_of(slab(1));
  const RepairReport report = repair(map);
  EXPECT_EQ(report.doublets + report.insets, 0U);
}

TEST(Repair, TurnedEdgesLeaveNothingWrong) {
  std::uint64_t doublets = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Rng rng(seed);
    CellMap map = map_of(seed % 2 == 0 ? grid(9, 9) : slab(2));
    for (int k = 0; k < 400; ++k) {
      turn_edge(map, pick(rng, map.half_count()), 2);
    }
    const CellMap::Counts before = map.counts();
    doublets += repair(map).doublets;
    ASSERT_NO_THROW(map.validate());
    expect_kept(before, map.to_mesh());
    ASSERT_FALSE(HasFailure()) << "seed " << seed;
  }
  EXPECT_GT(doublets, 100U);
}

}  // namespace
}  // namespace rattan
