// SPDX-License-Identifier: MIT
#include "engine/remesh/unfold.h"

#include <array>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "engine/remesh/repair.h"
#include "tests/engine/remesh/small_maps.h"

namespace rattan {
namespace {

using namespace test;

constexpr std::uint32_t kSide = 4;
constexpr std::uint32_t kMiddle = 6;  // the vertex (1, 1) of a grid of 4 x 4

/// A flat grid whose quad from (1, 1) to (2, 2) is two triangles, parted by the diagonal between
/// its other two corners; (2, 2) is moved beyond that, which folds the second triangle over.
PolygonMesh folded_grid() {
  const PolygonMesh whole = grid(kSide, kSide);
  PolygonMesh mesh;
  mesh.positions = whole.positions;
  const std::uint32_t up = kSide + 1;
  for (std::size_t f = 0; f < whole.face_count(); ++f) {
    const auto face = whole.face(f);
    if (face[0] == kMiddle) {
      mesh.add_face(std::array{kMiddle, kMiddle + 1, kMiddle + up});
      mesh.add_face(std::array{kMiddle + 1, kMiddle + up + 1, kMiddle + up});
    } else {
      mesh.add_face(face);
    }
  }
  mesh.positions[kMiddle + up + 1] = Vec3d(1.3, 1.3, 0.0);
  return mesh;
}

std::size_t faces_down(const PolygonMesh& mesh) {
  std::size_t count = 0;
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const auto face = mesh.face(f);
    double area = 0.0;
    for (std::size_t k = 0; k < face.size(); ++k) {
      const Vec3d& p = mesh.positions[face[k]];
      const Vec3d& q = mesh.positions[face[(k + 1) % face.size()]];
      area += p.x() * q.y() - p.y() * q.x();
    }
    count += area <= 0.0 ? 1 : 0;
  }
  return count;
}

TEST(Unfold, TheOtherDiagonalTakesTheFoldOut) {
  PolygonMesh mesh = folded_grid();
  const PolygonMesh before = mesh;
  ASSERT_EQ(faces_down(mesh), 1U);
  EXPECT_EQ(unfold_faces(mesh), 1U);
  EXPECT_EQ(faces_down(mesh), 0U);
  EXPECT_EQ(mesh.face_count(), before.face_count());
  EXPECT_EQ(mesh.positions, before.positions);
  EXPECT_TRUE(check_topology(mesh).clean());
}

TEST(Unfold, FeaturesStay) {
  PolygonMesh mesh = folded_grid();
  mesh.feature_edges.push_back({kMiddle + 1, kMiddle + kSide + 1});
  mesh.vertex_flags.assign(mesh.vertex_count(), 0);
  mesh.vertex_flags[kMiddle + 1] = mesh.vertex_flags[kMiddle + kSide + 1] = kFeatureVertex;
  unfold_faces(mesh);
  CellMap map(std::move(mesh));
  const std::uint32_t h = map.find_half(kMiddle + 1, kMiddle + kSide + 1);
  ASSERT_NE(h, CellMap::kNone);
  EXPECT_TRUE(map.is_feature(h));
}

TEST(Unfold, WhatIsNotFoldedStays) {
  for (PolygonMesh mesh : {grid(3, 5), slab(1), slab(2)}) {
    const PolygonMesh before = mesh;
    EXPECT_EQ(unfold_faces(mesh), 0U);
    ASSERT_EQ(mesh.face_count(), before.face_count());
    EXPECT_EQ(mesh.positions, before.positions);
  }
}

TEST(Unfold, TurnedEdgesLeaveASimpleMesh) {
  std::uint64_t replaced = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    Rng rng(seed);
    CellMap map = map_of(seed % 2 == 0 ? grid(9, 9) : slab(2));
    for (int k = 0; k < 200; ++k) {
      turn_edge(map, pick(rng, map.half_count()));
    }
    repair(map);
    const CellMap::Counts before = map.counts();
    PolygonMesh mesh = map.to_mesh();
    replaced += unfold_faces(mesh);
    expect_kept(before, mesh);
    ASSERT_FALSE(HasFailure()) << "seed " << seed;
  }
  EXPECT_GT(replaced, 100U);
}

}  // namespace
}  // namespace rattan
