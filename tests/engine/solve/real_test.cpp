// SPDX-License-Identifier: MIT
#include <array>

#include <Eigen/SparseCholesky>
#include <gtest/gtest.h>

#include "tests/engine/solve/test_system.h"

namespace rattan::test {
namespace {

// (L + fit) x = b by Cholesky. Without fit, each listed component [begin, end) is grounded at its
// first node, the right-hand side made consistent, and the mean taken out.
template <class Block>
Eigen::MatrixXd direct(std::uint32_t n, const std::vector<Edge<Block>>& edges,
                       const std::vector<float>& fit, const std::vector<Value<Block>>& rhs,
                       const std::vector<std::pair<int, int>>& components) {
  constexpr int kReals = static_cast<int>(BlockOps<Block>::kReals);
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::MatrixXd b(n, kReals);
  for (std::uint32_t i = 0; i < n; ++i) {
    entries.emplace_back(i, i, fit.empty() ? 0.0 : fit[i]);
    for (int k = 0; k < kReals; ++k) {
      b(i, k) = reals<Block>(rhs[i])[k];
    }
  }
  for (const auto& e : edges) {
    entries.emplace_back(e.i, e.j, -e.weight);
    entries.emplace_back(e.j, e.i, -e.weight);
    entries.emplace_back(e.i, e.i, e.weight);
    entries.emplace_back(e.j, e.j, e.weight);
  }
  for (const auto& [begin, end] : components) {
    auto part = b.middleRows(begin, end - begin);
    part.rowwise() -= Eigen::RowVectorXd(part.colwise().mean());
    entries.emplace_back(begin, begin, 1.0);
  }
  Eigen::SparseMatrix<double> a(n, n);
  a.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(a);
  Eigen::MatrixXd x = factors.solve(b);
  for (const auto& [begin, end] : components) {
    auto part = x.middleRows(begin, end - begin);
    part.rowwise() -= Eigen::RowVectorXd(part.colwise().mean());
  }
  return x;
}

template <class Block>
double relative_error(const std::vector<Value<Block>>& x, const Eigen::MatrixXd& expected) {
  double error2 = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    for (std::size_t k = 0; k < BlockOps<Block>::kReals; ++k) {
      const double d = reals<Block>(x[i])[k] -
                       expected(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k));
      error2 += d * d;
    }
  }
  return std::sqrt(error2) / expected.norm();
}

struct Solved {
  SolveReport nested, reference;
  double nested_error = 0.0;
  double reference_error = 0.0;
};

template <class Block>
Solved solve_both(std::uint32_t n, const std::vector<Edge<Block>>& edges, std::uint32_t tile_size,
                  const std::vector<float>& fit, const std::vector<std::pair<int, int>>& components,
                  float tolerance = 1e-6F) {
  const auto rhs = random_values<Block>(n, 77, false);
  TestSystem<Block> s;
  build<Block>(s, n, edges, tile_size, fit, rhs);
  TaskGraph tasks;
  const auto hierarchy = build_hierarchy(s.store, s.layout, s.halo, s.graph, {}, tasks);
  SolveOptions options;
  options.coarse_stiffness = 0.5F;
  options.tolerance = tolerance;
  Solved out;
  const Eigen::MatrixXd expected = direct<Block>(n, edges, fit, rhs, components);
  out.nested = solve_nested<Block>(s.store, s.layout, s.halo, s.fields, *hierarchy, options, tasks);
  out.nested_error = relative_error<Block>(s.solution(), expected);
  // The stored board holds the border values.
  const auto x = s.solution();
  const auto board = s.board();
  for (std::uint32_t t = 0; t < s.layout.tile_count(); ++t) {
    const auto border = read(s.store, s.halo.border, TileId(t));
    for (std::size_t k = 0; k < border.size(); ++k) {
      const TileExtent& e = s.layout.tiles[t];
      EXPECT_NEAR(reals<Block>(board[e.border_first + k])[0],
                  reals<Block>(x[e.first + border[k]])[0], 1e-5F * expected.cwiseAbs().maxCoeff());
    }
  }
  out.reference = solve_reference<Block>(s.store, s.layout, s.halo, s.fields, options, tasks);
  out.reference_error = relative_error<Block>(s.solution(), expected);
  return out;
}

TEST(Real, AgreesWithCholeskyOnAConnectedGraph) {
  constexpr int kNodes = 60 * 50;
  const auto s = solve_both<RealBlock>(kNodes, phase_grid<RealBlock>(60, 50, false, 0, 0, 0, 1),
                                       400, {}, {{0, kNodes}});
  EXPECT_LT(s.nested_error, 1e-4);
  EXPECT_LT(s.reference_error, 1e-4);
  EXPECT_LT(s.nested.iterations, 25U);
}

TEST(Real, SmallSystemsNeedNoCoarseLevel) {
  const auto s = solve_both<RealBlock>(100, phase_grid<RealBlock>(10, 10, false, 0, 0, 0, 1), 400,
                                       {}, {{0, 100}});
  EXPECT_LT(s.nested_error, 1e-4);
}

TEST(Real, TakesTheMeanOutOfEveryComponent) {
  auto edges = phase_grid<RealBlock>(40, 30, false, 0, 0, 0, 2);
  for (Edge<RealBlock> e : phase_grid<RealBlock>(20, 20, true, 0, 0, 0, 3)) {
    e.i += 1200;
    e.j += 1200;
    edges.push_back(e);
  }
  std::vector<std::pair<int, int>> components{{0, 1200}, {1200, 1600}};
  for (int i = 1600; i < 1610; ++i) {
    components.emplace_back(i, i + 1);
  }
  const auto s = solve_both<RealBlock>(1610, edges, 300, {}, components);
  EXPECT_LT(s.nested_error, 1e-4);
  EXPECT_LT(s.reference_error, 1e-4);
}

TEST(Real, SolvesThreeSidesByOneFilter) {
  constexpr int kNodes = 60 * 50;
  const std::vector<float> fit(kNodes, 0.01F);
  const auto s = solve_both<Real3Block>(kNodes, phase_grid<Real3Block>(60, 50, false, 0, 0, 0, 1),
                                        400, fit, {});
  EXPECT_LT(s.nested_error, 1e-4);
  EXPECT_LT(s.reference_error, 1e-4);
}

TEST(Real, BearsNegativeWeightsOfASemidefiniteForm) {
  // Cotangents of obtuse triangles: the diagonals of the squares pull the wrong way.
  std::vector<Edge<RealBlock>> edges;
  for (const GridEdge& g : grid_edges(50, 50, false, curve_order(50, 50))) {
    const float w = g.dx != 0.0 && g.dy != 0.0 ? -0.3F : 1.0F;
    edges.push_back({g.i, g.j, w, {w}});
  }
  const auto s = solve_both<RealBlock>(2500, edges, 400, {}, {{0, 2500}});
  EXPECT_LT(s.reference_error, 1e-3);
  EXPECT_LT(s.nested_error, 1e-3);
}

TEST(Real, IterationsBarelyGrowWithTheSystem) {
  std::uint64_t small = 0;
  for (const std::uint32_t side : {40U, 160U}) {
    TestSystem<RealBlock> s;
    build<RealBlock>(s, side * side, phase_grid<RealBlock>(side, side, false, 0, 0, 0, 1), 2000, {},
                     random_values<RealBlock>(side * side, 5, false));
    TaskGraph tasks;
    const auto hierarchy = build_hierarchy(s.store, s.layout, s.halo, s.graph, {}, tasks);
    SolveOptions options;
    options.coarse_stiffness = 0.5F;
    const auto report =
        solve_nested<RealBlock>(s.store, s.layout, s.halo, s.fields, *hierarchy, options, tasks);
    if (side == 40U) {
      small = report.iterations;
    }
    EXPECT_LE(report.iterations, small + 3);
    EXPECT_LE(report.iterations, 9U);
    EXPECT_EQ(report.passes, 3 * report.iterations + 7);
  }
}

TEST(Real, ZeroRightHandSideGivesZero) {
  TestSystem<RealBlock> s;
  build<RealBlock>(s, 900, phase_grid<RealBlock>(30, 30, false, 0, 0, 0, 1), 200);
  s.fields.rhs = {};
  s.fields.fit = {};
  TaskGraph tasks;
  const auto hierarchy = build_hierarchy(s.store, s.layout, s.halo, s.graph, {}, tasks);
  const auto report =
      solve_nested<RealBlock>(s.store, s.layout, s.halo, s.fields, *hierarchy, {}, tasks);
  EXPECT_EQ(report.iterations, 0U);
  for (const float x : s.solution()) {
    EXPECT_EQ(x, 0.0F);
  }
}

// A weak fit, and sources that sum to zero: the solution is long waves.
TEST(Real, CyclesReachLongWavesInAFixedNumberOfPasses) {
  std::array<double, 2> error_of_one{};
  std::size_t run = 0;
  for (const std::uint32_t side : {48U, 192U}) {
    const std::uint32_t n = side * side;
    const auto edges = phase_grid<RealBlock>(side, side, false, 0, 0, 0, 1);
    auto rhs = random_values<RealBlock>(n, 5, false);
    double sum = 0.0;
    for (const float b : rhs) {
      sum += static_cast<double>(b);
    }
    for (float& b : rhs) {
      b -= static_cast<float>(sum / n);
    }
    const std::vector<float> fit(n, 1e-3F / static_cast<float>(n));
    Eigen::MatrixXd expected = direct<RealBlock>(n, edges, fit, rhs, {});
    expected.array() -= expected.mean();
    double before = 1.0;
    for (const int cycles : {1, 2, 3}) {
      TestSystem<RealBlock> s;
      build<RealBlock>(s, n, edges, 700, fit, rhs);
      TaskGraph tasks;
      const auto hierarchy = build_hierarchy(s.store, s.layout, s.halo, s.graph, {}, tasks);
      SolveOptions options;
      options.coarse_stiffness = 0.5F;
      options.cycles = cycles;
      const std::uint64_t passes = tasks.passes();
      const auto report =
          solve_nested<RealBlock>(s.store, s.layout, s.halo, s.fields, *hierarchy, options, tasks);
      EXPECT_EQ(report.passes, 1U + 2U * static_cast<unsigned>(cycles));
      EXPECT_EQ(tasks.passes() - passes, report.passes + report.setup_passes);
      auto x = s.solution();
      double mean = 0.0;
      for (const float v : x) {
        mean += static_cast<double>(v) / n;
      }
      for (float& v : x) {
        v -= static_cast<float>(mean);
      }
      const double error = relative_error<RealBlock>(x, expected);
      EXPECT_LT(error, 0.6 * before);
      before = error;
      if (cycles == 1) {
        error_of_one[run++] = error;
      }
    }
  }
  EXPECT_LT(error_of_one[0], 0.05);
  EXPECT_LT(error_of_one[1], 0.05);
}

}  // namespace
}  // namespace rattan::test
