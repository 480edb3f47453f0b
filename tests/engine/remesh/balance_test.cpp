// SPDX-License-Identifier: MIT
#include "engine/remesh/balance.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "engine/remesh/topology.h"
#include "tests/engine/remesh/shapes.h"

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

bool quad_inside(const CellMap& map, std::uint32_t h) {
  return !map.is_hole(map.face(h)) && map.degree(map.face(h)) == 4;
}

/// Turns random edges between two quads, where the map stays simple and without doublets.
int turn_edges(CellMap& map, int count, Rng& rng) {
  int done = 0;
  for (int attempt = 0; attempt < 50 * count && done < count; ++attempt) {
    const std::uint32_t h = pick(rng, map.half_count());
    const std::uint32_t t = CellMap::twin(h);
    if (!map.half_alive(h) || !quad_inside(map, h) || !quad_inside(map, t) ||
        map.face(h) == map.face(t) || map.valence(map.origin(h)) < 4 ||
        map.valence(map.target(h)) < 4) {
      continue;
    }
    const std::uint32_t a = map.next(map.next(h)), b = map.next(map.next(t));
    if (map.origin(a) == map.origin(b) || map.adjacent(map.origin(a), map.origin(b))) {
      continue;
    }
    map.erase_edge(h);
    map.split_face(a, b);
    ++done;
  }
  return done;
}

CellMap flat_grid(std::uint32_t n) {
  CellMap map(grid(n, n));
  map.set_normals({});
  return map;
}

TEST(BalanceValences, TurnsAnEdgeBack) {
  CellMap map = flat_grid(10);
  Rng rng(5);
  const std::uint32_t h = map.find_half(5 * 11 + 5, 5 * 11 + 6);
  ASSERT_NE(h, CellMap::kNone);
  const std::uint32_t a = map.next(map.next(h)), b = map.next(map.next(CellMap::twin(h)));
  map.erase_edge(h);
  map.split_face(a, b);
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
    CellMap map = flat_grid(12);
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
  CellMap regular = flat_grid(6);
  const BalanceReport nothing = balance_valences(regular);
  EXPECT_EQ(nothing.collapsed + nothing.turned, 0U);

  const auto collapsed = [](bool bent) {
    Rng rng(2);
    CellMap map = flat_grid(20);
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
