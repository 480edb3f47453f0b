// SPDX-License-Identifier: MIT
#include "engine/remesh/clean.h"

#include <gtest/gtest.h>

#include "tests/engine/remesh/small_maps.h"

namespace rattan {
namespace {

using namespace test;

/// A square with an edge from its first corner to a vertex inside.
CellMap dangling(bool corner) {
  CellComplex cells = complex_of(5, 5, {{{0, 0}, {4, 0}, {0, 1}, {1, 2}, {2, 3}, {3, 4}}});
  cells.mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.4, 0.5, 0}};
  cells.mesh.vertex_flags.assign(5, 0);
  cells.mesh.vertex_flags[4] = corner ? kCornerVertex : 0;
  CellMap map(std::move(cells));
  map.set_normals({});
  return map;
}

TEST(Clean, EndsOfFeaturesInsideACellAreJoined) {
  CellMap map = dangling(true);
  const CellMap::Counts before = map.counts();
  clean(map, 1.0, 0.0);
  ASSERT_NO_THROW(map.validate());
  ASSERT_TRUE(map.vertex_alive(4));
  EXPECT_GE(map.valence(4), 2U);
  EXPECT_EQ(map.position(4), Vec3d(0.4, 0.5, 0.0));
  // By the corner straight ahead.
  EXPECT_TRUE(map.adjacent(4, 0));
  EXPECT_TRUE(map.adjacent(4, 2));
  EXPECT_EQ(map.counts().faces, 2);
  EXPECT_EQ(map.counts().euler(), before.euler());
}

TEST(Clean, OtherEndsGo) {
  CellMap map = dangling(false);
  clean(map, 1.0, 0.0);
  ASSERT_NO_THROW(map.validate());
  EXPECT_FALSE(map.vertex_alive(4));
  EXPECT_EQ(map.counts().faces, 1);
}

}  // namespace
}  // namespace rattan
