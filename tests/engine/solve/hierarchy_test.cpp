// SPDX-License-Identifier: MIT
#include <map>

#include <gtest/gtest.h>

#include "engine/solve/passes.h"
#include "tests/engine/solve/test_system.h"

namespace rattan::test {
namespace {

TEST(Hierarchy, EveryLevelPartitionsTheOneBelow) {
  TestSystem<RealBlock> s;
  build<RealBlock>(s, 80 * 70, phase_grid<RealBlock>(80, 70, false, 0, 0, 0, 3), 500);
  TaskGraph tasks;
  const auto hierarchy = build_hierarchy(s.store, s.layout, s.halo, s.graph, {}, tasks);
  ASSERT_GE(hierarchy->levels.size(), 3U);
  EXPECT_LE(hierarchy->levels.back().layout.node_count, 300U);
  EXPECT_LT(hierarchy->levels[1].layout.node_count, 80U * 70U * 3U / 10U);
  for (std::size_t k = 0; k + 1 < hierarchy->levels.size(); ++k) {
    const Level& fine = hierarchy->levels[k];
    const Level& coarse = hierarchy->levels[k + 1];
    // Global parents of owned nodes, and for halo nodes the same seen from elsewhere.
    std::vector<std::uint64_t> parent(fine.layout.node_count);
    std::vector<std::pair<std::uint64_t, std::uint64_t>> seen;
    for (std::uint32_t t = 0; t < fine.layout.tile_count(); ++t) {
      const TileExtent& e = fine.layout.tiles[t];
      const TileId c(fine.coarse_tile[t]);
      const auto parents = read(*fine.store, fine.parent, TileId(t));
      const auto tree = read(*fine.store, fine.tree, TileId(t));
      const auto ids = read(*fine.store, fine.halo.halo_ids, TileId(t));
      const auto coarse_ids = read(*coarse.store, coarse.halo.halo_ids, c);
      const TileExtent& ce = coarse.layout.tiles[c.value];
      ASSERT_EQ(parents.size(), e.owned + e.halo);
      for (std::uint32_t i = 0; i < e.owned + e.halo; ++i) {
        const std::uint64_t p =
            parents[i] < ce.owned ? ce.first + parents[i] : coarse_ids[parents[i] - ce.owned];
        if (i < e.owned) {
          ASSERT_LT(parents[i], ce.owned);
          EXPECT_EQ(parents[i], parents[tree[i]]);
          parent[e.first + i] = p;
        } else {
          seen.emplace_back(ids[i - e.owned], p);
        }
      }
    }
    for (const auto& [node, p] : seen) {
      EXPECT_EQ(parent[node], p);
    }
    std::vector<int> members(coarse.layout.node_count, 0);
    std::uint64_t next = 0;
    for (const std::uint64_t p : parent) {
      ASSERT_LE(p, next);  // numbered by lowest member
      next = std::max(next, p + 1);
      ++members[p];
    }
    EXPECT_EQ(next, coarse.layout.node_count);
    EXPECT_LE(*std::max_element(members.begin(), members.end()), 8);
    double held = 0.0;
    for (std::uint32_t c = 0; c < coarse.layout.tile_count(); ++c) {
      for (const float n : read(*coarse.store, coarse.count, TileId(c))) {
        held += n;
      }
    }
    EXPECT_EQ(held, 80.0 * 70.0);
  }
}

TEST(Hierarchy, GraphsThatDoNotAggregateEndIt) {
  TestSystem<RealBlock> s;
  build<RealBlock>(s, 1000, {}, 100);
  TaskGraph tasks;
  const auto hierarchy = build_hierarchy(s.store, s.layout, s.halo, s.graph, {}, tasks);
  EXPECT_LE(hierarchy->levels.size(), 4U);
  EXPECT_EQ(hierarchy->levels.back().layout.node_count, 1000U);
}

template <class Block>
class Galerkin : public testing::Test {};
using Blocks = testing::Types<RealBlock, Real3Block, ComplexBlock, PairBlock>;
TYPED_TEST_SUITE(Galerkin, Blocks);

TYPED_TEST(Galerkin, CoarseEnergyIsTheEnergyOfProlongedValues) {
  using Block = TypeParam;
  using Ops = BlockOps<Block>;
  constexpr std::uint32_t kNodes = 40 * 30;
  std::vector<float> fit(kNodes);
  for (std::uint32_t i = 0; i < kNodes; ++i) {
    fit[i] = 0.01F * static_cast<float>(i % 7);
  }
  TestSystem<Block> s;
  build<Block>(s, kNodes, wild_grid<Block>(40, 30, 5), 111, fit,
               random_values<Block>(kNodes, 6, false));
  TaskGraph tasks;
  const auto hierarchy =
      build_hierarchy(s.store, s.layout, s.halo, s.graph, {.coarsest_nodes = 20}, tasks);
  SystemHierarchy<Block> system;
  coarsen_system(system, s.store, s.fields, *hierarchy, 1.0F, tasks);
  ASSERT_GE(system.levels.size(), 4U);
  const float penalty = Ops::kPeriodic ? 0.2F : 0.0F;

  int turning_self_edges = 0;
  int parallel_edges = 0;
  for (std::size_t k = 1; k < system.levels.size(); ++k) {
    SystemLevel<Block>& coarse = system.levels[k];
    SystemLevel<Block>& fine = system.levels[k - 1];
    const TileLayout& layout = coarse.level->layout;
    coarse.board.resize(layout.border_count);
    for (std::uint32_t c = 0; c < layout.tile_count(); ++c) {
      TileSystem<Block> tile;
      tile.load(coarse, TileId(c));
      const auto x = random_values<Block>(tile.extent.owned, c + 31, false);
      write(*coarse.store, coarse.solution, TileId(c), x);
      publish_border<Value<Block>>(x, tile.border.span(), tile.extent.border_first, coarse.board);
      for (std::uint32_t i = 0; i < tile.extent.owned; ++i) {
        std::map<std::uint32_t, int> times;
        for (std::uint32_t e = tile.row_begin[i]; e < tile.row_begin[i + 1]; ++e) {
          const std::uint32_t j = tile.neighbor[e];
          turning_self_edges += j == i && Ops::turn(tile.coefficient[e]) != 0 ? 1 : 0;
          parallel_edges += j != i && ++times[j] == 2 ? 1 : 0;
        }
      }
    }
    SmoothPlan<Block> plan;
    plan.start = Start::kProlong;
    plan.sweeps = 0;
    plan.values = fine.solution;
    plan.board = &fine.board;
    plan.coarse_values = coarse.solution;
    plan.mode = Ops::kPeriodic ? SweepMode::kPenalty : SweepMode::kLinear;
    smooth<Block>(fine, &coarse, plan, tasks);
    const Evaluation on_fine = evaluate(fine, penalty, tasks);
    const Evaluation on_coarse = evaluate(coarse, penalty, tasks);
    EXPECT_NEAR(on_fine.energy, on_coarse.energy, 2e-5 * std::abs(on_fine.energy));
    EXPECT_NEAR(on_fine.energy_unit, on_coarse.energy_unit, 2e-5 * std::abs(on_fine.energy_unit));
  }
  if (std::is_same_v<Block, PairBlock>) {
    EXPECT_GT(turning_self_edges, 100);
    EXPECT_GT(parallel_edges, 100);
  }
}

}  // namespace
}  // namespace rattan::test
