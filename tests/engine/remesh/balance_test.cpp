// SPDX-License-Identifier: MIT
#include "engine/remesh/balance.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "tests/engine/remesh/small_maps.h"

namespace rattan {
namespace {

using namespace test;

int irregularity_of(const CellMap& map) {
  int sum = 0;
  for (std::uint32_t v = 0; v < map.vertex_count(); ++v) {
    if (map.vertex_alive(v) && !map.on_boundary(v)) {
      const int off = static_cast<int>(map.valence(v)) - 4;
      sum += off * off;
    }
  }
  return sum;
}

/// Turns random edges between two quads.
int turn_edges(CellMap& map, int count, Rng& rng) {
  int done = 0;
  for (int attempt = 0; attempt < 50 * count && done < count; ++attempt) {
    done += turn_edge(map, pick(rng, map.half_count())) ? 1 : 0;
  }
  return done;
}

TEST(BalanceValences, TurnsAnEdgeBack) {
  CellMap map = map_of(grid(10, 10));
  ASSERT_TRUE(turn_edge(map, map.find_half(5 * 11 + 5, 5 * 11 + 6)));
  ASSERT_EQ(irregularity_of(map), 4);
  const BalanceReport report = balance_valences(map);
  EXPECT_EQ(report.turned + report.collapsed, 1U);
  EXPECT_EQ(irregularity_of(map), 0);
  ASSERT_NO_THROW(map.validate());
}

TEST(BalanceValences, LowersIrregularityAndKeepsTheRest) {
  Rng rng(11);
  std::uint64_t collapsed = 0, turned = 0;
  for (int round = 0; round < 60; ++round) {
    CellMap map = map_of(grid(12, 12));
    ASSERT_GT(turn_edges(map, 3 + round % 40, rng), 0);
    const CellMap::Counts before = map.counts();
    const int irregular = irregularity_of(map);
    const BalanceReport report = balance_valences(map);
    ASSERT_NO_THROW(map.validate());
    const auto done = static_cast<int>(report.collapsed + report.turned);
    EXPECT_LE(irregularity_of(map), irregular - done);
    collapsed += report.collapsed;
    turned += report.turned;
    const CellMap::Counts after = map.counts();
    EXPECT_EQ(after.euler(), before.euler());
    EXPECT_EQ(after.components, before.components);
    EXPECT_EQ(after.boundary_loops, before.boundary_loops);
    EXPECT_EQ(after.faces, before.faces - static_cast<std::int64_t>(report.collapsed));
    const MeshTopology t = check_topology(map.to_mesh());
    EXPECT_EQ(t.bad_degree, 0U);
    EXPECT_EQ(t.repeated_vertex, 0U);
    EXPECT_EQ(t.non_manifold_edges, 0U);
    EXPECT_EQ(t.non_manifold_vertices, 0U);
    EXPECT_EQ(t.inconsistent_edges, 0U);
    EXPECT_EQ(t.valence_two, 0U);
  }
  EXPECT_GT(collapsed, 0U);
  EXPECT_GT(turned, 0U);
}

TEST(BalanceValences, LeavesWhatIsRegularOrBent) {
  CellMap regular = map_of(grid(6, 6));
  const BalanceReport nothing = balance_valences(regular);
  EXPECT_EQ(nothing.collapsed + nothing.turned, 0U);

  const auto collapsed = [](bool bent) {
    Rng rng(2);
    CellMap map = map_of(grid(20, 20));
    turn_edges(map, 80, rng);
    std::vector<Vec3d> normals;
    for (std::uint32_t v = 0; v < map.vertex_count(); ++v) {
      const double angle = bent ? 2.4 * v : 0.0;
      normals.emplace_back(std::cos(angle), std::sin(angle), 0.0);
    }
    map.set_normals(normals);
    return balance_valences(map).collapsed;
  };
  EXPECT_GT(collapsed(false), 5U);
  EXPECT_EQ(collapsed(true), 0U);
}

}  // namespace
}  // namespace rattan
