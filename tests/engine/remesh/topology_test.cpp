// SPDX-License-Identifier: MIT
#include "engine/remesh/topology.h"

#include <gtest/gtest.h>

#include "tests/engine/remesh/small_maps.h"

namespace rattan {
namespace {

using namespace test;

const std::vector<std::vector<std::uint32_t>> kTetrahedron{
    {0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};

TEST(CheckTopology, CountsCleanMeshes) {
  const MeshTopology plane = check_topology(grid(3, 2));
  EXPECT_TRUE(plane.clean());
  EXPECT_EQ(plane.vertices, 12U);
  EXPECT_EQ(plane.edges, 17U);
  EXPECT_EQ(plane.faces, 6U);
  EXPECT_EQ(plane.components, 1U);
  EXPECT_EQ(plane.boundary_loops, 1U);
  for (int genus = 0; genus < 4; ++genus) {
    const MeshTopology closed = check_topology(slab(genus));
    EXPECT_TRUE(closed.clean());
    EXPECT_EQ(closed.euler(), 2 - 2 * genus);
    EXPECT_EQ(closed.boundary_loops, 0U);
  }
  Rng rng(1);
  int holes = 0;
  const MeshTopology punched = check_topology(join(punch(slab(3), 3, rng, holes), grid(2, 2)));
  EXPECT_TRUE(punched.clean());
  EXPECT_EQ(punched.components, 2U);
  EXPECT_EQ(punched.boundary_loops, 1U + static_cast<unsigned>(holes));
  EXPECT_EQ(punched.euler(), -4 - holes + 1);
  EXPECT_TRUE(check_topology(mesh_of(4, kTetrahedron)).clean());
  EXPECT_TRUE(check_topology(PolygonMesh{}).clean());
}

TEST(CheckTopology, FindsEachViolation) {
  const auto broken = [](std::uint32_t vertices, std::vector<std::vector<std::uint32_t>> faces) {
    return check_topology(mesh_of(vertices, faces));
  };
  EXPECT_EQ(broken(3, {{0, 1, 5}}).out_of_range, 1U);
  EXPECT_EQ(broken(5, {{0, 1, 2, 3, 4}}).bad_degree, 1U);
  EXPECT_EQ(broken(4, {{0, 1, 0, 2}, {1, 2, 3}}).repeated_vertex, 1U);
  EXPECT_EQ(broken(4, {{0, 1, 2}}).unreferenced, 1U);

  const MeshTopology sheets = broken(3, {{0, 1, 2}, {2, 1, 0}});
  EXPECT_EQ(sheets.duplicate_faces, 1U);
  EXPECT_EQ(sheets.valence_two, 3U);
  EXPECT_EQ(sheets.non_manifold_edges, 0U);

  const MeshTopology fins = broken(5, {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}});
  EXPECT_EQ(fins.non_manifold_edges, 1U);

  auto flipped = kTetrahedron;
  std::swap(flipped[0][0], flipped[0][1]);
  const MeshTopology turned = broken(4, flipped);
  EXPECT_EQ(turned.inconsistent_edges, 3U);
  EXPECT_EQ(turned.non_manifold_vertices, 0U);

  EXPECT_EQ(broken(5, {{0, 1, 2}, {0, 3, 4}}).non_manifold_vertices, 1U);
  EXPECT_EQ(broken(5, {{0, 1, 2}, {0, 3, 4}}).boundary_loops, 2U);

  // Two quads around vertex 4, inside a plane of four faces.
  const MeshTopology doublet = broken(
      9, {{0, 1, 4, 3}, {1, 2, 3, 4}, {5, 6, 1, 0}, {6, 7, 2, 1}, {7, 8, 3, 2}, {8, 5, 0, 3}});
  EXPECT_EQ(doublet.valence_two, 1U);
  EXPECT_EQ(doublet.boundary_loops, 1U);
  EXPECT_FALSE(doublet.clean());
}

TEST(CheckTopology, TwoSolidsThatShareAnEdge) {
  const PolygonMesh mesh = voxels(2, 2, 1, [](int x, int y, int) { return (x == 0) == (y == 0); });
  const MeshTopology t = check_topology(mesh);
  EXPECT_EQ(t.non_manifold_edges, 1U);
  EXPECT_GT(t.non_manifold_vertices, 0U);
}

}  // namespace
}  // namespace rattan
