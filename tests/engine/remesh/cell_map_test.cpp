// SPDX-License-Identifier: MIT
#include "engine/remesh/cell_map.h"

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "tests/engine/remesh/shapes.h"

namespace rattan {
namespace {

using namespace test;

TEST(CellMap, CountsShapesOfKnownTopology) {
  const CellMap plane(grid(3, 2));
  EXPECT_EQ(plane.counts().euler(), 1);
  EXPECT_EQ(plane.counts().boundary_loops, 1);
  for (int genus = 0; genus < 4; ++genus) {
    const CellMap closed(slab(genus));
    closed.validate();
    EXPECT_EQ(closed.counts().euler(), 2 - 2 * genus);
    EXPECT_EQ(closed.counts().components, 1);
    EXPECT_EQ(closed.counts().boundary_loops, 0);
  }
}

TEST(CellMap, OperationsKeepTopologyAndLinks) {
  Rng rng(7);
  for (int round = 0; round < 200; ++round) {
    int holes = 0;
    CellMap map(punch(join(slab(round % 3), grid(4, 4)), round % 4, rng, holes));
    const CellMap::Counts before = map.counts();
    EXPECT_EQ(before.boundary_loops, 1 + holes);
    shake(map, 300, {.erase = 2, .contract = 2, .split_edge = 1, .split_face = 2, .dangle = 1},
          rng);
    ASSERT_NO_THROW(map.validate());
    const CellMap::Counts after = map.counts();
    ASSERT_EQ(after.euler(), before.euler());
    ASSERT_EQ(after.components, before.components);
    ASSERT_EQ(after.boundary_loops, before.boundary_loops);
  }
}

TEST(CellMap, RoundTripThroughAComplexKeepsTheMap) {
  Rng rng(3);
  for (int round = 0; round < 100; ++round) {
    int holes = 0;
    CellMap map(punch(slab(2), 2, rng, holes));
    shake(map, 200, {}, rng);
    const CellMap again(to_complex(map, rng));
    ASSERT_NO_THROW(again.validate());
    ASSERT_EQ(again.counts().vertices, map.counts().vertices);
    ASSERT_EQ(again.counts().edges, map.counts().edges);
    ASSERT_EQ(again.counts().faces, map.counts().faces);
    ASSERT_EQ(again.counts().boundary_loops, map.counts().boundary_loops);
  }
}

TEST(CellMap, InsetAndStarRefineInPlace) {
  CellMap map(grid(1, 1));
  map.inset_face(0);
  map.validate();
  EXPECT_EQ(map.counts().faces, 5);
  EXPECT_EQ(map.counts().vertices, 8);
  std::vector<std::uint32_t> halves;
  map.face_halves(0, halves);
  map.star_face(0, halves, map.face_centre(0));
  map.validate();
  EXPECT_EQ(map.counts().faces, 8);
  EXPECT_EQ(map.counts().euler(), 1);
}

TEST(CellMap, DividesAVertexOfTwoFans) {
  PolygonMesh mesh;
  for (int i = 0; i < 5; ++i) {
    mesh.positions.emplace_back(i, i % 2, 0.0);
  }
  mesh.add_face(std::array<std::uint32_t, 3>{0, 1, 2});
  mesh.add_face(std::array<std::uint32_t, 3>{0, 3, 4});
  const CellMap map(std::move(mesh));
  map.validate();
  EXPECT_EQ(map.counts().vertices, 6);
  EXPECT_EQ(map.counts().components, 2);
  EXPECT_EQ(map.counts().boundary_loops, 2);
}

TEST(CellMap, RefusesWhatIsNoComplex) {
  PolygonMesh twice;
  twice.positions.resize(4, Vec3d::Zero());
  twice.add_face(std::array<std::uint32_t, 3>{0, 1, 2});
  twice.add_face(std::array<std::uint32_t, 3>{0, 1, 3});
  EXPECT_THROW(CellMap{std::move(twice)}, InternalError);
  PolygonMesh three;
  three.positions.resize(5, Vec3d::Zero());
  three.add_face(std::array<std::uint32_t, 3>{0, 1, 2});
  three.add_face(std::array<std::uint32_t, 3>{1, 0, 3});
  three.add_face(std::array<std::uint32_t, 3>{0, 1, 4});
  EXPECT_THROW(CellMap{std::move(three)}, InternalError);
}

}  // namespace
}  // namespace rattan
