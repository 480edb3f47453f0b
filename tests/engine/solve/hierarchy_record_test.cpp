// SPDX-License-Identifier: MIT
#include "engine/solve/hierarchy_record.h"

#include <cstring>

#include <gtest/gtest.h>

#include "engine/solve/hierarchy.h"
#include "tests/engine/solve/test_system.h"

namespace rattan::test {
namespace {

template <class T>
std::string content(Store& store, Field<T> field, TileId tile) {
  if (field.name.empty() || !store.has_chunk(field.name, tile)) {
    return "none";
  }
  const ChunkBytes bytes = store.read_chunk(field.name, tile);
  return {reinterpret_cast<const char*>(bytes->data()), bytes->size()};
}

void expect_equal(const Level& a, const Level& b) {
  EXPECT_EQ(a.layout.node_count, b.layout.node_count);
  EXPECT_EQ(a.layout.border_count, b.layout.border_count);
  EXPECT_EQ(a.coarsest(), b.coarsest());
  EXPECT_EQ(a.pass_over(), b.pass_over());
  EXPECT_EQ(a.group, b.group);
  EXPECT_EQ(a.coarse_tile, b.coarse_tile);
  EXPECT_EQ(a.first_parent, b.first_parent);
  EXPECT_EQ(a.parents, b.parents);
  ASSERT_EQ(a.layout.tile_count(), b.layout.tile_count());
  for (std::uint32_t t = 0; t < a.layout.tile_count(); ++t) {
    const TileExtent& x = a.layout.tiles[t];
    const TileExtent& y = b.layout.tiles[t];
    EXPECT_EQ(std::tie(x.first, x.owned, x.halo, x.border_first, x.border),
              std::tie(y.first, y.owned, y.halo, y.border_first, y.border));
    for (const auto field : {&Level::row_begin, &Level::neighbor, &Level::parent, &Level::tree,
                             &Level::border_parent}) {
      EXPECT_EQ(content(*a.store, a.*field, TileId(t)), content(*b.store, b.*field, TileId(t)));
    }
    for (const auto field : {&HaloFields::halo_slots, &HaloFields::border}) {
      EXPECT_EQ(content(*a.store, a.halo.*field, TileId(t)),
                content(*b.store, b.halo.*field, TileId(t)));
    }
    EXPECT_EQ(content(*a.store, a.halo.halo_ids, TileId(t)),
              content(*b.store, b.halo.halo_ids, TileId(t)));
    EXPECT_EQ(content(*a.store, a.count, TileId(t)), content(*b.store, b.count, TileId(t)));
  }
}

// Of a system so large that one level isn't kept in memory.
TEST(HierarchyRecord, ComesBackWholeAndSolvesTheSame) {
  constexpr std::uint32_t kSide = 400;
  TestSystem<ComplexBlock> s;
  build<ComplexBlock>(s, kSide * kSide,
                      phase_grid<ComplexBlock>(kSide, kSide, false, 0.1, 0, 0.4, 6), 8192);
  TaskGraph tasks;
  const auto made = build_hierarchy(s.store, s.layout, s.halo, s.graph, {}, tasks);
  save_hierarchy(s.store, *made);
  const auto loaded = load_hierarchy(s.store);
  ASSERT_EQ(made->levels.size(), loaded->levels.size());
  EXPECT_EQ(made->levels[1].store, &s.store);
  EXPECT_EQ(made->levels[2].store, &made->memory);
  for (std::size_t k = 0; k < made->levels.size(); ++k) {
    EXPECT_EQ(made->levels[k].store == &s.store, loaded->levels[k].store == &s.store);
    expect_equal(made->levels[k], loaded->levels[k]);
  }

  // In one go on the one that was built, in two parts on the one that was loaded.
  SolveOptions options;
  options.unit_norm = true;
  ASSERT_TRUE(can_solve_coarse(*made, options));
  SolveHooks<ComplexBlock> whole;
  const SolveReport expected = solve_nested<ComplexBlock>(s.store, s.layout, s.halo, s.fields,
                                                          *made, options, tasks, &whole);
  const auto solution = s.solution();
  s.store.erase(s.fields.solution.name);
  SolveHooks<ComplexBlock> parts;
  parts.coarse = solve_coarse<ComplexBlock>(s.store, s.fields, *loaded, options, tasks, parts);
  EXPECT_TRUE(parts.coarse.done);
  const SolveReport report = solve_nested<ComplexBlock>(s.store, s.layout, s.halo, s.fields,
                                                        *loaded, options, tasks, &parts);
  const auto again = s.solution();
  ASSERT_EQ(again.size(), solution.size());
  EXPECT_EQ(std::memcmp(again.data(), solution.data(), again.size() * sizeof again[0]), 0);
  EXPECT_EQ(report.energy, expected.energy);
  EXPECT_EQ(report.passes, expected.passes);
  EXPECT_EQ(report.setup_passes, expected.setup_passes);
  EXPECT_EQ(report.iterations, expected.iterations);
}

}  // namespace
}  // namespace rattan::test
