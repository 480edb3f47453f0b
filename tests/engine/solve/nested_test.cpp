// SPDX-License-Identifier: MIT
#include <cstring>

#include <gtest/gtest.h>

#include "engine/solve/newton.h"
#include "tests/engine/solve/test_system.h"

namespace rattan::test {
namespace {

template <class Block>
struct Run {
  SolveReport report;
  std::vector<Value<Block>> x;
};

template <class Block>
Run<Block> nested(const std::vector<Edge<Block>>& edges, std::uint32_t nodes,
                  std::uint32_t tile_size, const SolveOptions& options,
                  TaskGraphOptions graph_options = {}, const std::vector<float>& fit = {},
                  const std::vector<Value<Block>>& rhs = {}) {
  TestSystem<Block> s;
  build<Block>(s, nodes, edges, tile_size, fit, rhs);
  TaskGraph tasks(graph_options);
  const auto hierarchy = build_hierarchy(s.store, s.layout, s.halo, s.graph, {}, tasks);
  Run<Block> run;
  run.report = solve_nested<Block>(s.store, s.layout, s.halo, s.fields, *hierarchy, options, tasks);
  run.x = s.solution();
  return run;
}

template <class Block>
Run<Block> reference(const std::vector<Edge<Block>>& edges, std::uint32_t nodes,
                     const SolveOptions& options, const std::vector<float>& fit = {},
                     const std::vector<Value<Block>>& rhs = {}) {
  TestSystem<Block> s;
  build<Block>(s, nodes, edges, 1000, fit, rhs);
  TaskGraph tasks;
  Run<Block> run;
  run.report = solve_reference<Block>(s.store, s.layout, s.halo, s.fields, options, tasks);
  run.x = s.solution();
  return run;
}

constexpr double kStep = 2.0 * exact::kPi / 16.0;

TEST(Nested, FlatTorusIsExact) {
  constexpr std::uint32_t kSide = 64;
  std::vector<std::uint32_t> frames;
  const auto edges = phase_grid<PairBlock>(kSide, kSide, true, kStep, kStep, 0.0, 7, &frames);
  SolveOptions options;
  options.unit_norm = true;
  const auto run = nested<PairBlock>(edges, kSide * kSide, 700, options);
  EXPECT_LT(run.report.energy, 1e-8 * kSide * kSide);

  // Away from node 0, phases advance by kStep for each unit of x and of y.
  const auto number = curve_order(kSide, kSide);
  const auto straight = [&](std::uint32_t node) {
    return apply<PairBlock>(BlockOps<PairBlock>::adjoint(frame_change<PairBlock>(frames[node])),
                            run.x[node]);
  };
  const PairValue origin = straight(number[0]);
  for (std::uint32_t y = 0; y < kSide; ++y) {
    for (std::uint32_t x = 0; x < kSide; ++x) {
      const PairValue v = straight(number[y * kSide + x]);
      const Complex u_expected = multiply(origin.u, polar(1.0, kStep * x));
      const Complex v_expected = multiply(origin.v, polar(1.0, kStep * y));
      ASSERT_LT(std::abs(v.u - u_expected), 2e-3F);
      ASSERT_LT(std::abs(v.v - v_expected), 2e-3F);
    }
  }
}

template <class Block>
void expect_agreement(double noise, bool wraps, std::uint32_t seed) {
  constexpr std::uint32_t kSide = 48;
  const auto edges = phase_grid<Block>(kSide, kSide, wraps, kStep, kStep, noise, seed);
  const SolveOptions options;
  const auto a = nested<Block>(edges, kSide * kSide, 500, options);
  const auto b = reference<Block>(edges, kSide * kSide, options);
  EXPECT_NEAR(a.report.energy_unit, b.report.energy_unit, 0.05 * b.report.energy_unit);
  EXPECT_NEAR(a.report.energy, b.report.energy, 0.05 * b.report.energy);
  EXPECT_GT(b.report.energy, 1.0);
  EXPECT_LT(b.report.gradient_norm, 1e-2);
  EXPECT_LE(a.report.passes, 3U);
}

TEST(Nested, AgreesWithTheReferenceOnNoisyPhases) {
  expect_agreement<PairBlock>(0.3, true, 1);
  expect_agreement<PairBlock>(0.3, false, 2);
  expect_agreement<ComplexBlock>(0.5, false, 3);
}

TEST(Nested, AgreesWithTheReferenceOnFittedDirections) {
  constexpr std::uint32_t kSide = 48;
  constexpr std::uint32_t kNodes = kSide * kSide;
  const auto edges = phase_grid<ComplexBlock>(kSide, kSide, false, 0.05, 0.0, 0.2, 5);
  // Noisy targets around a constant direction, in the gauge of the noise-free grid at node 0.
  auto rhs = random_values<ComplexBlock>(kNodes, 9, false);
  std::vector<float> fit(kNodes, 0.1F);
  for (auto& b : rhs) {
    b = 0.1F * (b + Complex(1.0F, 0.0F));
  }
  SolveOptions options;
  options.coarse_stiffness = 0.5F;
  const auto a = nested<ComplexBlock>(edges, kNodes, 500, options, {}, fit, rhs);
  const auto b = reference<ComplexBlock>(edges, kNodes, options, fit, rhs);
  EXPECT_NEAR(a.report.energy_unit, b.report.energy_unit, 0.05 * std::abs(b.report.energy_unit));
  double error2 = 0.0;
  for (std::uint32_t i = 0; i < kNodes; ++i) {
    error2 += std::norm(unit(a.x[i]) - unit(b.x[i]));
  }
  EXPECT_LT(std::sqrt(error2 / kNodes), 0.03);
}

TEST(Nested, PassesDoNotGrowWithTheSystem) {
  SolveOptions options;
  double small_energy = 0.0;
  for (const std::uint32_t side : {48U, 192U}) {
    const auto edges = phase_grid<PairBlock>(side, side, false, kStep, kStep, 0.3, 7);
    const auto run = nested<PairBlock>(edges, side * side, 2000, options);
    EXPECT_EQ(run.report.passes, 3U);
    EXPECT_EQ(run.report.setup_passes, 2U);
    EXPECT_EQ(run.report.iterations, 16U);
    EXPECT_EQ(run.report.unknowns, 4U * side * side);
    const double energy = run.report.energy / side / side;
    if (side == 48U) {
      small_energy = energy;
    } else {
      EXPECT_NEAR(energy, small_energy, 0.05 * small_energy);
    }
  }
}

template <class Block>
void expect_same_bytes(const SolveOptions& options) {
  constexpr std::uint32_t kSide = 60;
  const auto edges = phase_grid<Block>(kSide, kSide, true, kStep, kStep, 0.4, 11);
  const auto rhs = random_values<Block>(kSide * kSide, 2, false);
  const auto one = nested<Block>(edges, kSide * kSide, 250, options, {1, 1}, {}, rhs);
  for (const TaskGraphOptions other :
       {TaskGraphOptions{2, 8}, TaskGraphOptions{1, 8}, TaskGraphOptions{2, 3}}) {
    const auto many = nested<Block>(edges, kSide * kSide, 250, options, other, {}, rhs);
    ASSERT_EQ(one.x.size(), many.x.size());
    EXPECT_EQ(
        std::memcmp(static_cast<const void*>(one.x.data()), static_cast<const void*>(many.x.data()),
                    one.x.size() * sizeof(Value<Block>)),
        0);
    EXPECT_EQ(one.report.energy, many.report.energy);
  }
}

TEST(Nested, BytesDoNotDependOnThreadsOrTilesInFlight) {
  SolveOptions options;
  expect_same_bytes<RealBlock>(options);
  expect_same_bytes<Real3Block>(options);
  options.newton_steps = 2;
  expect_same_bytes<ComplexBlock>(options);
  expect_same_bytes<PairBlock>(options);
}

TEST(Newton, StepsNeverRaiseTheEnergyAndConverge) {
  const auto edges = phase_grid<PairBlock>(48, 48, false, kStep, kStep, 0.6, 3);
  SolveOptions options;
  double before = 0.0;
  double gradient = 0.0;
  double first_gradient = 0.0;
  for (const int steps : {0, 1, 2, 4, 16}) {
    options.newton_steps = steps;
    const auto run = nested<PairBlock>(edges, 48 * 48, 300, options);
    if (steps > 0) {
      EXPECT_LE(run.report.energy, before * (1.0 + 1e-7));
      EXPECT_LT(run.report.gradient_norm, gradient);
    } else {
      first_gradient = run.report.gradient_norm;
    }
    before = run.report.energy;
    gradient = run.report.gradient_norm;
  }
  EXPECT_LT(gradient, 0.03 * first_gradient);
}

TEST(Newton, LineSearchFindsTheFirstMinimum) {
  // (t - 2)^2 (1 + t^2 / 100)
  EXPECT_NEAR(descend({-4.0, 1.04, -0.04, 0.01}), 2.0, 1e-9);
  EXPECT_EQ(descend({0.5, 1.0, 0.0, 0.0}), 0.0);
}

TEST(Nested, UnitNormsAreUnit) {
  SolveOptions options;
  options.unit_norm = true;
  for (const int newton : {0, 2}) {
    options.newton_steps = newton;
    const auto run = nested<PairBlock>(phase_grid<PairBlock>(30, 30, false, kStep, kStep, 0.5, 3),
                                       900, 200, options);
    for (const PairValue& v : run.x) {
      ASSERT_NEAR(std::abs(v.u), 1.0F, 1e-6F);
      ASSERT_NEAR(std::abs(v.v), 1.0F, 1e-6F);
    }
    EXPECT_NEAR(run.report.energy, run.report.energy_unit, 1e-4 * run.report.energy);
  }
}

template <class Block>
void expect_norms(std::uint32_t tile_size, int newton_steps, bool by_reference) {
  constexpr std::uint32_t kNodes = 900;
  constexpr Field<PartNorms> kNorms{"test/norms"};
  TestSystem<Block> s;
  build<Block>(s, kNodes, phase_grid<Block>(30, 30, false, kStep, kStep, 0.5, 3), tile_size, {},
               {});
  TaskGraph tasks;
  SolveOptions options;
  options.unit_norm = true;
  options.newton_steps = newton_steps;
  const auto hierarchy = build_hierarchy(s.store, s.layout, s.halo, s.graph, {}, tasks);
  const auto solve = [&] {
    if (by_reference) {
      solve_reference<Block>(s.store, s.layout, s.halo, s.fields, options, tasks);
    } else {
      solve_nested<Block>(s.store, s.layout, s.halo, s.fields, *hierarchy, options, tasks);
    }
    return s.solution();
  };
  const auto without = solve();
  EXPECT_FALSE(s.store.has_chunk(kNorms.name, TileId(0)));
  options.norms = kNorms;
  const auto with = solve();
  EXPECT_EQ(std::memcmp(with.data(), without.data(), with.size() * sizeof(with[0])), 0);
  std::vector<PartNorms> norms;
  for (std::uint32_t t = 0; t < s.layout.tile_count(); ++t) {
    const auto tile = read(s.store, kNorms, TileId(t));
    norms.insert(norms.end(), tile.begin(), tile.end());
  }
  ASSERT_EQ(norms.size(), kNodes);
  double below = 0.0;
  for (const PartNorms& n : norms) {
    for (const float part : n) {
      ASSERT_GT(part, 0.0F);
      ASSERT_LT(part, 1.5F);
      below += part < 0.999F ? 1.0 : 0.0;
    }
  }
  // The noise pulls them together: as they were before they were brought to one.
  EXPECT_GT(below, kNodes);
}

TEST(Nested, NormsAreKeptOnRequest) {
  for (const std::uint32_t tile_size : {200U, 10000U}) {
    expect_norms<PairBlock>(tile_size, 0, false);
    expect_norms<PairBlock>(tile_size, 2, false);
  }
  expect_norms<PairBlock>(10000, 0, true);
  expect_norms<ComplexBlock>(200, 0, false);
}

TEST(Nested, EveryComponentIsSolved) {
  // Two grids without a link, then vertices without an edge.
  auto edges = phase_grid<PairBlock>(20, 20, false, kStep, kStep, 0.0, 3);
  for (Edge<PairBlock> e : phase_grid<PairBlock>(30, 10, false, kStep, kStep, 0.0, 4)) {
    e.i += 400;
    e.j += 400;
    edges.push_back(e);
  }
  SolveOptions options;
  options.unit_norm = true;
  options.newton_steps = 1;
  const auto run = nested<PairBlock>(edges, 705, 100, options);
  EXPECT_LT(run.report.energy, 0.01);
  for (const PairValue& v : run.x) {
    ASSERT_NEAR(std::abs(v.u), 1.0F, 1e-6F);
  }
}

TEST(Nested, SmallestSystems) {
  SolveOptions options;
  for (const std::uint32_t nodes : {1U, 2U, 3U}) {
    std::vector<Edge<PairBlock>> edges;
    for (std::uint32_t i = 0; i + 1 < nodes; ++i) {
      edges.push_back({i, i + 1, 1.0F, make_coefficient<PairBlock>(1.0F, 0.5, 1.0, i + 1)});
    }
    for (const std::uint32_t tile_size : {1U, 8U}) {
      const auto run = nested<PairBlock>(edges, nodes, tile_size, options);
      EXPECT_NEAR(run.report.energy, 0.0, 1e-5);
      EXPECT_NEAR(std::abs(run.x[0].u), 1.0F, 1e-2F);
    }
  }
  EXPECT_EQ(nested<PairBlock>({}, 0, 8, options).report.unknowns, 0U);
}

}  // namespace
}  // namespace rattan::test
