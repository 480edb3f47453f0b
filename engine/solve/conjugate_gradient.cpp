// SPDX-License-Identifier: MIT
//
// Based on: Notay, Flexible conjugate gradients (2000). The cycle is not symmetric (it relaxes only
// on the way up, which saves two passes over the finest tiles in each iteration), so each direction
// is made conjugate to the previous one explicitly.

#include "engine/solve/conjugate_gradient.h"

#include <cmath>

#include "engine/solve/coarsest_solver.h"

namespace rattan {

namespace {

constexpr int kCycleSweeps = 4;  // on coarse levels, forward and backward in turn
constexpr int kFinestSweeps = 2;
constexpr int kCoarsestSweeps = 32;  // where the coarsest level isn't factorised

template <class Block>
class Solver {
 public:
  using Ops = BlockOps<Block>;
  Solver(SystemHierarchy<Block>& system, const CgProblem<Block>& problem, TaskGraph& tasks)
      : system_(system),
        problem_(problem),
        tasks_(tasks),
        first_(problem.level),
        finest_(system.levels[first_]),
        board_p_(finest_.level->layout.border_count, zero_value<Block>()) {
    problem_.board->assign(board_p_.size(), zero_value<Block>());
  }
  ~Solver() {
    try {
      finest_.store->erase(kDirection.name);
      finest_.store->erase(kProduct.name);
    } catch (const Error&) {
      // Scratch that cannot be erased costs disk space, nothing else.
    }
  }
  Solver(const Solver&) = delete;
  Solver& operator=(const Solver&) = delete;

  CgResult run() {
    CgResult result;
    double pq = 0.0;
    double pr = 0.0;
    const double first = advance(0.0, Step::kFirst);
    result.passes = 1;
    double norm2 = first;
    const double goal = static_cast<double>(problem_.tolerance) * problem_.tolerance * first;
    while (norm2 > goal && norm2 > 0.0 &&
           result.iterations < static_cast<std::uint64_t>(problem_.max_iterations)) {
      coarse_cycle();
      const double zq = precondition(result.iterations > 0);
      const double beta = result.iterations > 0 ? -zq / pq : 0.0;
      multiply(beta, result.iterations > 0, pq, pr);
      result.passes += 2;
      if (!(pq > 0.0)) {
        break;
      }
      norm2 = advance(pr / pq, result.iterations == 0 ? Step::kSecond : Step::kLater);
      ++result.passes;
      ++result.iterations;
    }
    if (result.iterations == 0) {
      clear_answer();
    }
    return result;
  }

 private:
  enum class Step { kFirst, kSecond, kLater };
  static constexpr Field<Value<Block>> kDirection{"solve/cg_direction"};
  static constexpr Field<Value<Block>> kProduct{"solve/cg_product"};

  bool has_coarse() const { return first_ + 1 < system_.levels.size(); }
  SystemLevel<Block>& next() { return system_.levels[first_ + 1]; }
  PassOver over() const { return finest_.level->pass_over(); }

  // x += alpha p, r -= alpha q, and r restricted to the next level. Returns |r|^2.
  double advance(double alpha, Step step) {
    struct State {
      TileSystem<Block> tile;
      ChunkView<Value<Block>> old_r, old_x, p, q;
      std::vector<Value<Block>> r, x, sums;
      double norm2 = 0.0;
    };
    const Level& level = *finest_.level;
    const auto a = static_cast<float>(alpha);
    double norm2 = 0.0;
    std::unique_ptr<CoarseWriter<Block>> writer;
    if (has_coarse()) {
      writer = std::make_unique<CoarseWriter<Block>>(finest_, next(), next().residual);
    }
    run_pass<State>(
        tasks_, "conjugate gradients", level.layout.tile_count(),
        [&](TileId t, State& s) {
          if (has_coarse()) {
            s.tile.load(finest_, t);
            s.tile.load_links(finest_, t);
          }
          s.old_r = read(*finest_.store, finest_.residual, t);
          if (step != Step::kFirst) {
            s.p = read(*finest_.store, kDirection, t);
            s.q = read(*finest_.store, kProduct, t);
          }
          if (step == Step::kLater) {
            s.old_x = read(*finest_.store, problem_.x, t);
          }
        },
        [&](TileId t, State& s) {
          s.r.assign(s.old_r.begin(), s.old_r.end());
          if (step != Step::kFirst) {
            s.x.assign(s.r.size(), zero_value<Block>());
            for (std::size_t i = 0; i < s.r.size(); ++i) {
              if (step == Step::kLater) {
                s.x[i] = s.old_x[i];
              }
              add_scaled<Block>(s.x[i], a, s.p[i]);
              add_scaled<Block>(s.r[i], -a, s.q[i]);
            }
          }
          for (const Value<Block>& v : s.r) {
            s.norm2 += dot<Block>(v, v);
          }
          if (has_coarse()) {
            s.sums = restrict_owned<Block>(s.tile, level.first_parent[t.value],
                                           level.parents[t.value], s.r);
          }
        },
        [&](TileId t, State& s) {
          norm2 += s.norm2;
          if (step != Step::kFirst) {
            write(*finest_.store, finest_.residual, t, s.r);
            write(*finest_.store, problem_.x, t, s.x);
          }
          if (has_coarse()) {
            writer->add(t, s.sums);
          }
        },
        over());
    if (step != Step::kFirst) {
      for (std::size_t k = 0; k < board_p_.size(); ++k) {
        add_scaled<Block>((*problem_.board)[k], a, board_p_[k]);
      }
    }
    return norm2;
  }

  SmoothPlan<Block> plan_for(SystemLevel<Block>& s) const {
    SmoothPlan<Block> plan;
    plan.mode = problem_.mode;
    plan.penalty = problem_.mode == SweepMode::kNewton ? problem_.penalty : 0.0F;
    plan.symmetric = true;
    plan.rhs = s.residual;
    plan.values = s.correction;
    plan.board = &s.correction_board;
    return plan;
  }

  void coarse_cycle() {
    if (!has_coarse()) {
      return;
    }
    restrict_down(system_, first_ + 1, &SystemLevel<Block>::residual, tasks_);
    solve_coarsest();
    for (std::size_t k = system_.levels.size() - 1; k-- > first_ + 1;) {
      SystemLevel<Block>& s = system_.levels[k];
      SmoothPlan<Block> plan = plan_for(s);
      plan.start = Start::kProlong;
      plan.coarse_values = system_.levels[k + 1].correction;
      plan.sweeps = kCycleSweeps;
      smooth<Block>(s, &system_.levels[k + 1], plan, tasks_);
    }
  }

  void solve_coarsest() {
    SystemLevel<Block>& s = system_.levels.back();
    if constexpr (!Ops::kPeriodic) {
      Eigen::MatrixXd columns = CoarsestSolver::gather<Block>(s, s.residual);
      problem_.coarsest->solve(columns);
      CoarsestSolver::scatter<Block>(s, columns, s.correction, s.correction_board);
    } else {
      SmoothPlan<Block> plan = plan_for(s);
      plan.start = Start::kZero;
      plan.sweeps = kCoarsestSweeps;
      smooth<Block>(s, nullptr, plan, tasks_);
    }
  }

  // z on the finest level; returns <z, q> with the previous q.
  double precondition(bool with_product) {
    SmoothPlan<Block> plan = plan_for(finest_);
    if (with_product) {
      plan.dot_with[0] = kProduct;
    }
    if (has_coarse()) {
      plan.start = Start::kProlong;
      plan.coarse_values = next().correction;
      plan.sweeps = kFinestSweeps;
      return smooth<Block>(finest_, &next(), plan, tasks_)[0];
    }
    plan.start = Start::kZero;
    plan.sweeps = kCoarsestSweeps;
    return smooth<Block>(finest_, nullptr, plan, tasks_)[0];
  }

  // p = z + beta p, q = A p; <p, q> and <p, r>.
  void multiply(double beta, bool has_direction, double& pq, double& pr) {
    struct State {
      TileSystem<Block> tile;
      ChunkView<Value<Block>> z, old_p, r, at;
      std::vector<Value<Block>> p, q;
      double pq = 0.0;
      double pr = 0.0;
    };
    const auto b = static_cast<float>(beta);
    for (std::size_t k = 0; k < board_p_.size(); ++k) {
      Value<Block> p = finest_.correction_board[k];
      add_scaled<Block>(p, b, board_p_[k]);
      board_p_[k] = p;
    }
    pq = 0.0;
    pr = 0.0;
    run_pass<State>(
        tasks_, "conjugate gradients", finest_.level->layout.tile_count(),
        [&](TileId t, State& s) {
          s.tile.load(finest_, t);
          s.z = read(*finest_.store, finest_.correction, t);
          s.r = read(*finest_.store, finest_.residual, t);
          if (has_direction) {
            s.old_p = read(*finest_.store, kDirection, t);
          }
          if (problem_.mode == SweepMode::kNewton) {
            s.at = read(*finest_.store, finest_.solution, t);
          }
        },
        [&](TileId, State& s) {
          const std::uint32_t owned = s.tile.extent.owned;
          s.p.reserve(owned + s.tile.extent.halo);
          s.p.assign(s.z.begin(), s.z.end());
          for (std::size_t i = 0; i < s.old_p.size(); ++i) {
            add_scaled<Block>(s.p[i], b, s.old_p[i]);
          }
          for (const std::uint32_t slot : s.tile.halo_slots) {
            s.p.push_back(board_p_[slot]);
          }
          s.q.resize(owned);
          for (std::uint32_t i = 0; i < owned; ++i) {
            product_row(s.tile, i, s.p, s.at, s.q[i]);
            s.pq += dot<Block>(s.p[i], s.q[i]);
            s.pr += dot<Block>(s.p[i], s.r[i]);
          }
          s.p.resize(owned);
        },
        [&](TileId t, State& s) {
          pq += s.pq;
          pr += s.pr;
          write(*finest_.store, kDirection, t, s.p);
          write(*finest_.store, kProduct, t, s.q);
        },
        over());
  }

  void product_row(const TileSystem<Block>& tile, std::uint32_t i,
                   const std::vector<Value<Block>>& p, const ChunkView<Value<Block>>& at,
                   Value<Block>& q) const {
    const auto row = row_product<Block>(tile, i, p);
    const float* pi = reals<Block>(p[i]);
    for (std::size_t k = 0; k < Ops::kReals; ++k) {
      const std::size_t part = part_of<Block>(k);
      const double d = static_cast<double>(tile.stiffness(i, part)) + tile.fit_of(i);
      double value = d * pi[k] - row[k];
      if constexpr (Ops::kPeriodic) {
        if (at.size() != 0) {
          const float* u = reals<Block>(at[i]) + 2 * part;
          const float* pp = pi + 2 * part;
          const double eps = static_cast<double>(problem_.penalty) * tile.count(i);
          const double norm2 = static_cast<double>(u[0]) * u[0] + static_cast<double>(u[1]) * u[1];
          const double along =
              static_cast<double>(u[0]) * pp[0] + static_cast<double>(u[1]) * pp[1];
          value += 2.0 * eps * std::max(norm2 - 1.0, 0.0) * pi[k] + 4.0 * eps * along * u[k % 2];
        }
      }
      reals<Block>(q)[k] = static_cast<float>(value);
    }
  }

  void clear_answer() {
    for (std::uint32_t t = 0; t < finest_.level->layout.tile_count(); ++t) {
      write(*finest_.store, problem_.x, TileId(t),
            std::vector<Value<Block>>(finest_.level->layout.tiles[t].owned, zero_value<Block>()));
    }
  }

  SystemHierarchy<Block>& system_;
  const CgProblem<Block>& problem_;
  TaskGraph& tasks_;
  std::size_t first_;
  SystemLevel<Block>& finest_;  ///< level first_
  HaloBoard<Value<Block>> board_p_;
};

// Turns sums (a residual) or values on the finest level into zero-mean ones on components without
// fit: restricts, takes means where components are told apart, prolongs and subtracts.
template <class Block>
void remove_means(SystemHierarchy<Block>& system, Field<Value<Block>> field,
                  HaloBoard<Value<Block>>* board, const CoarsestSolver& coarsest,
                  TaskGraph& tasks) {
  struct State {
    TileSystem<Block> tile;
    ChunkView<Value<Block>> values, means;
    std::vector<Value<Block>> out;
  };
  SystemLevel<Block>& finest = system.levels[0];
  SystemLevel<Block>& last = system.levels.back();
  const Level& level = *finest.level;
  const bool has_coarse = system.levels.size() > 1;
  Eigen::MatrixXd columns;
  if (has_coarse) {
    CoarseWriter<Block> writer(finest, system.levels[1], system.levels[1].residual);
    run_pass<State>(
        tasks, "means", level.layout.tile_count(),
        [&](TileId t, State& s) {
          s.tile.extent = level.layout.tiles[t.value];
          s.tile.load_links(finest, t);
          s.values = read(*finest.store, field, t);
        },
        [&](TileId t, State& s) {
          s.out = restrict_owned(s.tile, level.first_parent[t.value], level.parents[t.value],
                                 s.values.span());
        },
        [&](TileId t, State& s) { writer.add(t, s.out); });
    restrict_down(system, 1, &SystemLevel<Block>::residual, tasks);
    columns = CoarsestSolver::gather<Block>(last, last.residual);
  } else {
    columns = CoarsestSolver::gather<Block>(last, field);
  }
  coarsest.component_means(columns);
  CoarsestSolver::scatter<Block>(last, columns, last.correction, last.correction_board);
  for (std::size_t k = system.levels.size() - 1; k-- > 1;) {
    SystemLevel<Block>& s = system.levels[k];
    SmoothPlan<Block> plan;
    plan.start = Start::kProlong;
    plan.sweeps = 0;
    plan.mode = SweepMode::kLinear;
    plan.values = s.correction;
    plan.board = &s.correction_board;
    plan.coarse_values = system.levels[k + 1].correction;
    smooth<Block>(s, &system.levels[k + 1], plan, tasks);
  }
  run_pass<State>(
      tasks, "means", level.layout.tile_count(),
      [&](TileId t, State& s) {
        s.tile.extent = level.layout.tiles[t.value];
        s.values = read(*finest.store, field, t);
        if (has_coarse) {
          s.tile.load_links(finest, t);
          s.means = read(*system.levels[1].store, system.levels[1].correction,
                         TileId(level.coarse_tile[t.value]));
        } else {
          s.means = read(*finest.store, finest.correction, t);
        }
      },
      [&](TileId, State& s) {
        s.out.assign(s.values.begin(), s.values.end());
        for (std::uint32_t i = 0; i < s.out.size(); ++i) {
          add_scaled<Block>(s.out[i], -1.0F, s.means[has_coarse ? s.tile.parent[i] : i]);
        }
      },
      [&](TileId t, State& s) { write(*finest.store, field, t, s.out); });
  if (board != nullptr) {
    const HaloBoard<Value<Block>> means =
        has_coarse ? prolong_border(finest, system.levels[1], system.levels[1].correction)
                   : last.correction_board;
    for (std::size_t k = 0; k < board->size(); ++k) {
      add_scaled<Block>((*board)[k], -1.0F, means[k]);
    }
  }
}

}  // namespace

template <class Block>
CgResult conjugate_gradients(SystemHierarchy<Block>& system, const CgProblem<Block>& problem,
                             TaskGraph& tasks) {
  return Solver<Block>(system, problem, tasks).run();
}

template <class Block>
void solve_real(SystemHierarchy<Block>& system, const SolveOptions& options, SolveReport& report,
                TaskGraph& tasks) {
  struct State {
    ChunkView<Value<Block>> rhs;
  };
  SystemLevel<Block>& finest = system.levels[0];
  const CoarsestSolver coarsest(system.levels.back());
  run_pass<State>(
      tasks, "right-hand side", finest.level->layout.tile_count(),
      [&](TileId t, State& s) {
        if (!finest.finest->rhs.name.empty()) {
          s.rhs = read(*finest.store, finest.finest->rhs, t);
        }
      },
      [](TileId, State&) {},
      [&](TileId t, State& s) {
        if (s.rhs.size() != 0) {
          write(*finest.store, finest.residual, t, s.rhs.span());
        } else {
          write(*finest.store, finest.residual, t,
                std::vector<Value<Block>>(finest.level->layout.tiles[t.value].owned,
                                          zero_value<Block>()));
        }
      });
  ++report.passes;
  if (coarsest.singular()) {
    remove_means<Block>(system, finest.residual, nullptr, coarsest, tasks);
    report.passes += 2;
  }
  CgProblem<Block> problem;
  problem.x = finest.solution;
  problem.board = &finest.board;
  problem.tolerance = options.tolerance;
  problem.max_iterations = options.max_iterations;
  problem.coarsest = &coarsest;
  const CgResult result = conjugate_gradients(system, problem, tasks);
  report.iterations += result.iterations;
  report.passes += result.passes;
  if (coarsest.singular()) {
    remove_means<Block>(system, finest.solution, &finest.board, coarsest, tasks);
    report.passes += 2;
  }
}

template void solve_real(SystemHierarchy<RealBlock>&, const SolveOptions&, SolveReport&,
                         TaskGraph&);
template void solve_real(SystemHierarchy<Real3Block>&, const SolveOptions&, SolveReport&,
                         TaskGraph&);
#define RATTAN_INSTANTIATE(Block)                                                         \
  template CgResult conjugate_gradients(SystemHierarchy<Block>&, const CgProblem<Block>&, \
                                        TaskGraph&);
RATTAN_FOR_EACH_BLOCK(RATTAN_INSTANTIATE)
#undef RATTAN_INSTANTIATE

}  // namespace rattan
