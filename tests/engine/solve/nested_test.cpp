// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

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
                  TaskGraphOptions graph_options = {}) {
  TestSystem<Block> s;
  build<Block>(s, nodes, edges, tile_size);
  TaskGraph tasks(graph_options);
  const auto hierarchy = build_hierarchy(s.store, s.layout, s.halo, s.graph, {}, tasks);
  Run<Block> run;
  run.report = solve_nested<Block>(s.store, s.layout, s.halo, s.fields, *hierarchy, options, tasks);
  run.x = s.solution();
  return run;
}

TEST(Nested, print) {
  const double step = 2.0 * exact::kPi / 16.0;
  for (const double noise : {0.0, 0.3, 0.8}) {
    const auto edges = phase_grid<PairBlock>(128, 128, true, step, step, noise, 7);
    SolveOptions options;
    for (int newton : {0, 5, 25}) {
      options.newton_steps = newton;
      const auto run = nested<PairBlock>(edges, 128 * 128, 2000, options);
      printf("noise %g newton %d: E %g unit %g grad %g passes %d its %d\n", noise, newton,
             run.report.energy, run.report.energy_unit, run.report.gradient_norm,
             (int)run.report.passes, (int)run.report.iterations);
    }
    TestSystem<PairBlock> s;
    build<PairBlock>(s, 128 * 128, edges, 2000);
    TaskGraph tasks;
    const auto r = solve_reference<PairBlock>(s.store, s.layout, s.halo, s.fields, options, tasks);
    printf("reference: E %g unit %g grad %g its %d\n", r.energy, r.energy_unit, r.gradient_norm,
           (int)r.iterations);
  }
}

TEST(Real, print) {
  for (std::uint32_t n : {64U, 128U, 256U, 512U}) {
    const auto edges = phase_grid<RealBlock>(n, n, false, 0, 0, 0, 7);
    for (float cs : {1.0F, 0.5F})
      for (float tol : {1e-2F, 1e-6F}) {
        TestSystem<RealBlock> s;
        build<RealBlock>(s, n * n, edges, 20000, {}, random_values<RealBlock>(n * n, 3, false));
        TaskGraph tasks;
        const auto hierarchy = build_hierarchy(s.store, s.layout, s.halo, s.graph, {}, tasks);
        SolveOptions options;
        options.tolerance = tol;
        options.coarse_stiffness = cs;
        const auto r = solve_nested<RealBlock>(s.store, s.layout, s.halo, s.fields, *hierarchy,
                                               options, tasks);
        printf("real n %u stiff %g tol %g: its %d passes %d grad %g\n", n * n, cs, tol,
               (int)r.iterations, (int)r.passes, r.gradient_norm);
      }
  }
}

}  // namespace
}  // namespace rattan::test
