// SPDX-License-Identifier: MIT
#include "engine/solve/cycles.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/solve/coarsest_solver.h"
#include "engine/solve/conjugate_gradient.h"

namespace rattan {

namespace {

// Sweeps, forward and backward in turn, after each visit from below.
constexpr int kSweeps = 4;
// The level on which conjugate gradients do most of the work, and how exactly.
constexpr std::size_t kCgLevel = 2;
constexpr float kCgTolerance = 0.03F;
constexpr int kCgIterations = 12;

template <class Block>
class Cycles {
 public:
  Cycles(SystemHierarchy<Block>& system, const SolveOptions& options, SolveHooks<Block>* hooks,
         Evaluation* evaluation, SolveReport& report, TaskGraph& tasks)
      : system_(system),
        options_(options),
        hooks_(hooks),
        evaluation_(evaluation),
        report_(report),
        tasks_(tasks),
        cg_level_(std::min(kCgLevel, system.levels.size() - 1)),
        coarsest_(system.levels.back()) {}

  void solve() {
    if (system_.levels.size() == 1) {
      SystemLevel<Block>& s = system_.levels[0];
      Eigen::MatrixXd columns = CoarsestSolver::gather<Block>(s, s.finest->rhs);
      coarsest_.solve(columns);
      CoarsestSolver::scatter<Block>(s, columns, s.solution, s.board);
      ++report_.passes;
      return;
    }
    copy_terms();
    solve_level(1);
    relax(0, {.start = Start::kProlong, .final = options_.cycles == 0});
    for (int cycle = 0; cycle < options_.cycles; ++cycle) {
      const bool last = cycle + 1 == options_.cycles;
      const Step step = restrict_residual(0, cycle > 0);
      if (last && hooks_ != nullptr && hooks_->moments) {
        hooks_->moments(step.mean, step.variance);
      }
      solve_level(1);
      relax(0, {.start = Start::kCorrect, .step = step.length, .based = cycle > 0, .final = last});
    }
    const int visits = 1 + options_.cycles;
    report_.passes += static_cast<std::uint64_t>(visits + options_.cycles);
    report_.iterations += static_cast<std::uint64_t>(visits * kSweeps);
  }

 private:
  // The right-hand side of the first coarse level, which coarsening has summed.
  void copy_terms() {
    SystemLevel<Block>& s = system_.levels[1];
    for (std::uint32_t t = 0; t < s.level->layout.tile_count(); ++t) {
      std::vector<Value<Block>> rhs;
      for (const CoarseTerm<Block>& term : read(*s.store, s.term, TileId(t))) {
        rhs.push_back(term.rhs);
      }
      write(*s.store, s.residual, TileId(t), rhs);
    }
  }

  // From `residual` of a level to its `solution`.
  void solve_level(std::size_t k) {
    SystemLevel<Block>& s = system_.levels[k];
    if (k + 1 == system_.levels.size()) {
      Eigen::MatrixXd columns = CoarsestSolver::gather<Block>(s, s.residual);
      coarsest_.solve(columns);
      CoarsestSolver::scatter<Block>(s, columns, s.solution, s.board);
      return;
    }
    if (k >= cg_level_) {
      CgProblem<Block> problem;
      problem.level = k;
      problem.x = s.solution;
      problem.board = &s.board;
      problem.tolerance = kCgTolerance;
      problem.max_iterations = kCgIterations;
      problem.coarsest = &coarsest_;
      conjugate_gradients(system_, problem, tasks_);
      return;
    }
    restrict_once(system_, k, &SystemLevel<Block>::residual, tasks_);
    solve_level(k + 1);
    relax(k, {.start = Start::kProlong, .final = false});
    const Step step = restrict_residual(k, false);
    solve_level(k + 1);
    relax(k, {.start = Start::kCorrect, .step = step.length, .final = true});
  }

  struct Step {
    float length = 1.0F;
    double mean = 0.0;  ///< of the values after the step, weighted by fit
    double variance = 0.0;
  };

  // One pass over level k: how far to go from `base` (zero if not `based`) to `solution`, by the
  // least energy, and the residual there, restricted. Coarse levels are too stiff or too soft by
  // factors that depend on the meshing; this is what makes up for it.
  Step restrict_residual(std::size_t k, bool based) {
    struct State {
      TileSystem<Block> tile;
      ChunkView<Value<Block>> x, base, rhs;
      std::vector<Value<Block>> residual_sums, product_sums;
      double along = 0.0, curvature = 0.0;
      std::array<double, 6> moments{};
    };
    SystemLevel<Block>& fine = system_.levels[k];
    SystemLevel<Block>& coarse = system_.levels[k + 1];
    const Level& level = *fine.level;
    CoarseWriter<Block> residual_writer(fine, coarse, coarse.residual);
    CoarseWriter<Block> product_writer(fine, coarse, coarse.product);
    double along = 0.0;
    double curvature = 0.0;
    std::array<double, 6> moments{};
    run_pass<State>(
        tasks_, "residual", level.layout.tile_count(),
        [&](TileId t, State& s) {
          s.tile.load(fine, t);
          s.tile.load_links(fine, t);
          s.x = read(*fine.store, fine.solution, t);
          if (based) {
            s.base = read(*fine.store, fine.base, t);
          }
          if (k > 0) {
            s.rhs = read(*fine.store, fine.residual, t);
          }
        },
        [&](TileId t, State& s) {
          std::vector<Value<Block>> d = gather_local(s.x.span(), s.tile.halo_slots, fine.board);
          std::vector<Value<Block>> base;
          if (based) {
            base = gather_local(s.base.span(), s.tile.halo_slots, fine.base_board);
            for (std::size_t i = 0; i < d.size(); ++i) {
              add_scaled<Block>(d[i], -1.0F, base[i]);
            }
          }
          const std::uint32_t owned = s.tile.extent.owned;
          std::vector<Value<Block>> residual(owned);
          std::vector<Value<Block>> product(owned);
          for (std::uint32_t i = 0; i < owned; ++i) {
            residual[i] = s.rhs.size() != 0 ? s.rhs[i] : s.tile.rhs_of(i);
            if (based) {
              add_scaled<Block>(residual[i], -1.0F, product_row(s.tile, i, base));
            }
            product[i] = product_row(s.tile, i, d);
            s.along += dot<Block>(d[i], residual[i]);
            s.curvature += dot<Block>(d[i], product[i]);
            if (k == 0) {
              const double w = s.tile.fit_of(i);
              const double a = based ? reals<Block>(base[i])[0] : 0.0F;
              const double b = reals<Block>(d[i])[0];
              const std::array<double, 6> m{w, w * a, w * b, w * a * a, w * a * b, w * b * b};
              for (std::size_t c = 0; c < m.size(); ++c) {
                s.moments[c] += m[c];
              }
            }
          }
          const std::uint32_t first = level.first_parent[t.value];
          const std::uint32_t parents = level.parents[t.value];
          s.residual_sums = restrict_owned<Block>(s.tile, first, parents, residual);
          s.product_sums = restrict_owned<Block>(s.tile, first, parents, product);
        },
        [&](TileId t, State& s) {
          residual_writer.add(t, s.residual_sums);
          product_writer.add(t, s.product_sums);
          along += s.along;
          curvature += s.curvature;
          for (std::size_t c = 0; c < moments.size(); ++c) {
            moments[c] += s.moments[c];
          }
        },
        level.pass_over());
    Step step;
    const double length = curvature > 0.0 ? along / curvature : 1.0;
    step.length = static_cast<float>(length);
    if (moments[0] > 0.0) {
      step.mean = (moments[1] + length * moments[2]) / moments[0];
      const double square =
          (moments[3] + length * (2.0 * moments[4] + length * moments[5])) / moments[0];
      step.variance = std::max(0.0, square - step.mean * step.mean);
    }
    for (std::uint32_t c = 0; c < coarse.level->layout.tile_count(); ++c) {
      const auto residual = read(*coarse.store, coarse.residual, TileId(c));
      const auto product = read(*coarse.store, coarse.product, TileId(c));
      std::vector<Value<Block>> left(residual.begin(), residual.end());
      for (std::size_t i = 0; i < left.size(); ++i) {
        add_scaled<Block>(left[i], -step.length, product[i]);
      }
      write(*coarse.store, coarse.residual, TileId(c), left);
    }
    coarse.store->erase(coarse.product.name);
    return step;
  }

  static Value<Block> product_row(const TileSystem<Block>& tile, std::uint32_t i,
                                  std::span<const Value<Block>> x) {
    const auto row = row_product<Block>(tile, i, x);
    const double d = static_cast<double>(tile.stiffness(i, 0)) + tile.fit_of(i);
    Value<Block> out;
    for (std::size_t k = 0; k < row.size(); ++k) {
      reals<Block>(out)[k] = static_cast<float>(d * reals<Block>(x[i])[k] - row[k]);
    }
    return out;
  }

  void relax(std::size_t k, SmoothPlan<Block> plan) {
    SystemLevel<Block>& s = system_.levels[k];
    plan.sweeps = kSweeps;
    plan.symmetric = true;
    plan.mode = SweepMode::kLinear;
    plan.values = s.solution;
    plan.board = &s.board;
    plan.base = s.base;
    plan.base_board = &s.base_board;
    plan.coarse_values = system_.levels[k + 1].solution;
    if (k > 0) {
      plan.rhs = s.residual;
    } else if (plan.final) {
      plan.hooks = hooks_;
      plan.evaluation = evaluation_;
    }
    smooth<Block>(s, &system_.levels[k + 1], plan, tasks_);
  }

  SystemHierarchy<Block>& system_;
  const SolveOptions& options_;
  SolveHooks<Block>* hooks_;
  Evaluation* evaluation_;
  SolveReport& report_;
  TaskGraph& tasks_;
  std::size_t cg_level_;
  const CoarsestSolver coarsest_;
};

}  // namespace

template <class Block>
void solve_in_cycles(SystemHierarchy<Block>& system, const SolveOptions& options,
                     SolveHooks<Block>* hooks, Evaluation* evaluation, SolveReport& report,
                     TaskGraph& tasks) {
  Cycles<Block>(system, options, hooks, evaluation, report, tasks).solve();
}

#define RATTAN_INSTANTIATE(Block)                                                                 \
  template void solve_in_cycles(SystemHierarchy<Block>&, const SolveOptions&, SolveHooks<Block>*, \
                                Evaluation*, SolveReport&, TaskGraph&);
RATTAN_INSTANTIATE(RealBlock)
RATTAN_INSTANTIATE(Real3Block)
#undef RATTAN_INSTANTIATE

}  // namespace rattan
