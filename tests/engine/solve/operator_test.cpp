// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "engine/solve/passes.h"
#include "tests/engine/solve/test_system.h"

namespace rattan::test {
namespace {

template <class Block>
class Operator : public testing::Test {};
using Blocks = testing::Types<RealBlock, Real3Block, ComplexBlock, PairBlock>;
TYPED_TEST_SUITE(Operator, Blocks);

template <class Block>
std::vector<Coefficient<Block>> some_coefficients() {
  std::vector<Coefficient<Block>> out;
  for (std::uint32_t r = 0; r < BlockOps<Block>::kTurns; ++r) {
    out.push_back(make_coefficient<Block>(0.7F, 0.3 + r, 1.9 - r, r));
    out.push_back(make_coefficient<Block>(1.3F, 2.0 * r, 0.4, r));
  }
  return out;
}

template <class Block>
void expect_near(const Value<Block>& a, const Value<Block>& b, float tolerance) {
  for (std::size_t k = 0; k < BlockOps<Block>::kReals; ++k) {
    EXPECT_NEAR(reals<Block>(a)[k], reals<Block>(b)[k], tolerance);
  }
}

TYPED_TEST(Operator, AdjointMovesAcrossTheInnerProduct) {
  using Block = TypeParam;
  const auto x = random_values<Block>(2, 5, false);
  for (const auto& c : some_coefficients<Block>()) {
    const auto back = BlockOps<Block>::adjoint(c);
    EXPECT_NEAR(dot<Block>(x[0], apply<Block>(c, x[1])), dot<Block>(apply<Block>(back, x[0]), x[1]),
                1e-6);
  }
}

TYPED_TEST(Operator, ComposeActsAsOneAfterTheOther) {
  using Block = TypeParam;
  const auto x = random_values<Block>(1, 6, false);
  for (const auto& p : some_coefficients<Block>()) {
    for (const auto& q : some_coefficients<Block>()) {
      expect_near<Block>(apply<Block>(BlockOps<Block>::compose(p, q), x[0]),
                         apply<Block>(p, apply<Block>(q, x[0])), 2e-6F);
    }
  }
}

TYPED_TEST(Operator, UnitCoefficientIsInvertedByItsAdjoint) {
  using Block = TypeParam;
  const auto x = random_values<Block>(1, 6, false);
  for (const auto& c : some_coefficients<Block>()) {
    const auto t = BlockOps<Block>::unit_of(c);
    expect_near<Block>(apply<Block>(BlockOps<Block>::adjoint(t), apply<Block>(t, x[0])), x[0],
                       1e-6F);
  }
}

TEST(PairOperator, TurnsAsTheContractSays) {
  const PairValue x{{0.1F, 0.2F}, {0.3F, 0.4F}};
  for (std::uint32_t r = 0; r < 4; ++r) {
    const PairBlock::Coefficient c{{0.5F, -0.6F}, {0.7F, 0.8F}, r};
    const PairValue t = quarter_turn(x, r);
    expect_near<PairBlock>(apply<PairBlock>(c, x), {multiply(c.a, t.u), multiply(c.b, t.v)}, 1e-7F);
  }
}

TYPED_TEST(Operator, EnergyIsTheSumOverEdgesAndTheGradientItsDerivative) {
  using Block = TypeParam;
  using Ops = BlockOps<Block>;
  constexpr std::uint32_t kNodes = 7 * 6;
  constexpr float kPenalty = 0.3F;
  std::vector<float> fit(kNodes);
  for (std::uint32_t i = 0; i < kNodes; ++i) {
    fit[i] = 0.1F * static_cast<float>(i % 5);
  }
  const auto rhs = random_values<Block>(kNodes, 8, false);
  TestSystem<Block> s;
  build<Block>(s, kNodes, wild_grid<Block>(7, 6, 4), 10, fit, rhs);
  auto x = random_values<Block>(kNodes, 9, false);
  s.set_solution(x);

  TaskGraph tasks;
  const auto hierarchy = build_hierarchy(s.store, s.layout, s.halo, s.graph, {}, tasks);
  SystemHierarchy<Block> system;
  coarsen_system(system, s.store, s.fields, *hierarchy, 1.0F, tasks);
  system.levels[0].board = s.board();
  const float penalty = Ops::kPeriodic ? kPenalty : 0.0F;
  const Evaluation e = evaluate(system.levels[0], penalty, tasks);
  const auto energy = [&] { return edge_energy<Block>(s, x, penalty, fit, rhs); };
  EXPECT_NEAR(e.energy, energy(), 1e-5 * std::abs(energy()));

  double gradient2 = 0.0;
  for (auto& v : x) {
    for (std::size_t k = 0; k < Ops::kReals; ++k) {
      float& real = reals<Block>(v)[k];
      const float at = real;
      const float up = at + 0x1p-9F;
      const float down = at - 0x1p-9F;
      real = up;
      const double high = energy();
      real = down;
      const double low = energy();
      real = at;
      const double g = (high - low) / (static_cast<double>(up) - down);
      gradient2 += g * g;
    }
  }
  EXPECT_NEAR(e.gradient_norm, std::sqrt(gradient2), 1e-4 * std::sqrt(gradient2));

  if (Ops::kPeriodic) {
    for (auto& v : x) {
      normalise<Block>(v);
    }
    const double unit = edge_energy<Block>(s, x, 0.0, fit, rhs);
    EXPECT_NEAR(e.energy_unit, unit, 1e-5 * std::abs(unit));
  }
}

// The level below the finest has turning self-edges, which the update must bear too.
template <class Block>
void expect_descent(std::size_t level, SweepMode mode, float penalty) {
  constexpr std::uint32_t kSide = 24;
  constexpr std::uint32_t kNodes = kSide * kSide;
  TestSystem<Block> s;
  std::vector<float> fit(kNodes, mode == SweepMode::kLinear ? 0.05F : 0.0F);
  const auto rhs = mode == SweepMode::kUnit ? std::vector<Value<Block>>{}
                                            : random_values<Block>(kNodes, 21, false);
  build<Block>(s, kNodes, wild_grid<Block>(kSide, kSide, 12), kNodes, fit, rhs);
  TaskGraph tasks;
  const auto hierarchy =
      build_hierarchy(s.store, s.layout, s.halo, s.graph, {.coarsest_nodes = 20}, tasks);
  SystemHierarchy<Block> system;
  coarsen_system(system, s.store, s.fields, *hierarchy, 1.0F, tasks);
  SystemLevel<Block>& l = system.levels.at(level);
  const auto x = random_values<Block>(static_cast<std::uint32_t>(l.level->layout.node_count), 22,
                                      mode != SweepMode::kLinear);
  write(*l.store, l.solution, TileId(0), x);
  SmoothPlan<Block> plan;
  plan.mode = mode;
  plan.penalty = mode == SweepMode::kPenalty ? penalty : 0.0F;
  plan.values = l.solution;
  plan.board = &l.board;
  double before = evaluate(l, plan.penalty, tasks).energy;
  const double first = before;
  for (int k = 0; k < 30; ++k) {
    plan.symmetric = k % 2 == 1;
    smooth<Block>(l, nullptr, plan, tasks);
    const double after = evaluate(l, plan.penalty, tasks).energy;
    EXPECT_LE(after, before + 2e-6 * std::abs(before)) << "sweep " << k;
    before = after;
  }
  EXPECT_LT(before, first - 0.01 * std::abs(first));
}

TYPED_TEST(Operator, SweepsWithoutOverRelaxationDescend) {
  for (const std::size_t level : {0U, 1U, 2U}) {
    expect_descent<TypeParam>(level, SweepMode::kLinear, 0.0F);
    if constexpr (BlockOps<TypeParam>::kPeriodic) {
      expect_descent<TypeParam>(level, SweepMode::kUnit, 0.0F);
      for (const float penalty : {0.05F, 0.2F, 3.0F}) {
        expect_descent<TypeParam>(level, SweepMode::kPenalty, penalty);
      }
    }
  }
}

}  // namespace
}  // namespace rattan::test
