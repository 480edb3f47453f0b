// SPDX-License-Identifier: MIT
#include "engine/solve/newton.h"

#include <algorithm>
#include <cmath>

namespace rattan {

namespace {

constexpr float kInnerTolerance = 0.1F;

// levels[0].residual = minus half the gradient at the solution. Returns its squared norm.
template <class Block>
double negative_gradient(SystemLevel<Block>& finest, float penalty, TaskGraph& tasks) {
  using Ops = BlockOps<Block>;
  struct State {
    TileSystem<Block> tile;
    ChunkView<Value<Block>> x;
    std::vector<Value<Block>> out;
    double norm2 = 0.0;
  };
  double norm2 = 0.0;
  run_pass<State>(
      tasks, "gradient", finest.level->layout.tile_count(),
      [&](TileId t, State& s) {
        s.tile.load(finest, t);
        s.x = read(*finest.store, finest.solution, t);
      },
      [&](TileId, State& s) {
        const auto x = gather_local(s.x.span(), s.tile.halo_slots, finest.board);
        s.out.resize(s.tile.extent.owned);
        for (std::uint32_t i = 0; i < s.out.size(); ++i) {
          const auto row = row_product<Block>(s.tile, i, x);
          const Value<Block> rhs = s.tile.rhs_of(i);
          const float* xi = reals<Block>(x[i]);
          for (std::size_t k = 0; k < Ops::kReals; ++k) {
            const std::size_t part = part_of<Block>(k);
            const float* u = xi + 2 * part;
            const double excess =
                static_cast<double>(u[0]) * u[0] + static_cast<double>(u[1]) * u[1] - 1.0;
            const double d = static_cast<double>(s.tile.stiffness(i, part)) + s.tile.fit_of(i) +
                             2.0 * penalty * excess;
            const double g = row[k] + reals<Block>(rhs)[k] - d * xi[k];
            reals<Block>(s.out[i])[k] = static_cast<float>(g);
            s.norm2 += g * g;
          }
        }
      },
      [&](TileId t, State& s) {
        norm2 += s.norm2;
        write(*finest.store, finest.residual, t, s.out);
      });
  return norm2;
}

// The energy at x + t p as a polynomial in t.
template <class Block>
Quartic along_line(SystemLevel<Block>& finest, Field<Value<Block>> step,
                   const HaloBoard<Value<Block>>& step_board, float penalty, TaskGraph& tasks) {
  using Ops = BlockOps<Block>;
  struct State {
    TileSystem<Block> tile;
    ChunkView<Value<Block>> x, p;
    Quartic sum;
  };
  Quartic q;
  run_pass<State>(
      tasks, "line search", finest.level->layout.tile_count(),
      [&](TileId t, State& s) {
        s.tile.load(finest, t);
        s.x = read(*finest.store, finest.solution, t);
        s.p = read(*finest.store, step, t);
      },
      [&](TileId, State& s) {
        const auto p = gather_local(s.p.span(), s.tile.halo_slots, step_board);
        const auto x = gather_local(s.x.span(), s.tile.halo_slots, finest.board);
        for (std::uint32_t i = 0; i < s.tile.extent.owned; ++i) {
          const auto row_p = row_product<Block>(s.tile, i, p);
          const auto row_x = row_product<Block>(s.tile, i, x);
          const Value<Block> rhs = s.tile.rhs_of(i);
          const float* xi = reals<Block>(x[i]);
          const float* pi = reals<Block>(p[i]);
          for (std::size_t k = 0; k < Ops::kReals; ++k) {
            const double d =
                static_cast<double>(s.tile.stiffness(i, part_of<Block>(k))) + s.tile.fit_of(i);
            s.sum.c1 += 2.0 * pi[k] * (d * xi[k] - row_x[k] - reals<Block>(rhs)[k]);
            s.sum.c2 += pi[k] * (d * pi[k] - row_p[k]);
          }
          for (std::size_t part = 0; part < Ops::kParts; ++part) {
            const double x0 = xi[2 * part];
            const double x1 = xi[2 * part + 1];
            const double p0 = pi[2 * part];
            const double p1 = pi[2 * part + 1];
            const double a = x0 * x0 + x1 * x1 - 1.0;
            const double b = 2.0 * (x0 * p0 + x1 * p1);
            const double c = p0 * p0 + p1 * p1;
            s.sum.c1 += penalty * 2.0 * a * b;
            s.sum.c2 += penalty * (b * b + 2.0 * a * c);
            s.sum.c3 += penalty * 2.0 * b * c;
            s.sum.c4 += penalty * c * c;
          }
        }
      },
      [&](TileId, State& s) {
        q.c1 += s.sum.c1;
        q.c2 += s.sum.c2;
        q.c3 += s.sum.c3;
        q.c4 += s.sum.c4;
      });
  return q;
}

template <class Block>
void take_step(SystemLevel<Block>& finest, Field<Value<Block>> step,
               const HaloBoard<Value<Block>>& step_board, float length, TaskGraph& tasks) {
  struct State {
    ChunkView<Value<Block>> x, p;
    std::vector<Value<Block>> out;
  };
  run_pass<State>(
      tasks, "step", finest.level->layout.tile_count(),
      [&](TileId t, State& s) {
        s.x = read(*finest.store, finest.solution, t);
        s.p = read(*finest.store, step, t);
      },
      [&](TileId, State& s) {
        s.out.assign(s.x.begin(), s.x.end());
        for (std::size_t i = 0; i < s.out.size(); ++i) {
          add_scaled<Block>(s.out[i], length, s.p[i]);
        }
      },
      [&](TileId t, State& s) { write(*finest.store, finest.solution, t, s.out); });
  for (std::size_t k = 0; k < finest.board.size(); ++k) {
    add_scaled<Block>(finest.board[k], length, step_board[k]);
  }
}

// The solution averaged over aggregates, on every coarse level: where the Newton matrix is taken.
template <class Block>
void restrict_solution(SystemHierarchy<Block>& system, TaskGraph& tasks) {
  struct State {
    ChunkView<Value<Block>> sums;
    ChunkView<CoarseTerm<Block>> term;
    std::vector<Value<Block>> out;
  };
  restrict_down(system, 0, &SystemLevel<Block>::solution, tasks);
  for (std::size_t k = 1; k < system.levels.size(); ++k) {
    SystemLevel<Block>& s = system.levels[k];
    run_pass<State>(
        tasks, "averages", s.level->layout.tile_count(),
        [&](TileId t, State& st) {
          st.sums = read(*s.store, s.solution, t);
          st.term = read(*s.store, s.term, t);
        },
        [&](TileId, State& st) {
          st.out.assign(st.sums.size(), zero_value<Block>());
          for (std::size_t i = 0; i < st.out.size(); ++i) {
            add_scaled<Block>(st.out[i], 1.0F / st.term[i].count, st.sums[i]);
          }
        },
        [&](TileId t, State& st) { write(*s.store, s.solution, t, st.out); }, s.level->pass_over());
  }
}

}  // namespace

double descend(const Quartic& q) {
  if (!(q.c1 < 0.0)) {
    return 0.0;
  }
  // The slope is negative at 0 and positive far out: bracket its first sign change, then bisect.
  const auto slope = [&](double t) {
    return q.c1 + t * (2.0 * q.c2 + t * (3.0 * q.c3 + t * 4.0 * q.c4));
  };
  double low = 0.0;
  double high = 0.125;
  while (slope(high) < 0.0 && high < 64.0) {
    low = high;
    high *= 2.0;
  }
  for (int k = 0; k < 50; ++k) {
    const double middle = 0.5 * (low + high);
    (slope(middle) < 0.0 ? low : high) = middle;
  }
  return low;
}

template <class Block>
void newton_steps(SystemHierarchy<Block>& system, const SolveOptions& options, SolveReport& report,
                  TaskGraph& tasks) {
  constexpr Field<Value<Block>> kStep{"solve/newton_step"};
  SystemLevel<Block>& finest = system.levels[0];
  HaloBoard<Value<Block>> step_board;
  for (int k = 0; k < options.newton_steps; ++k) {
    const double gradient2 = negative_gradient(finest, options.penalty, tasks);
    ++report.passes;
    if (!(gradient2 > 0.0)) {
      break;
    }
    restrict_solution(system, tasks);
    ++report.passes;
    CgProblem<Block> problem;
    problem.x = kStep;
    problem.board = &step_board;
    problem.mode = SweepMode::kNewton;
    problem.penalty = options.penalty;
    problem.tolerance = kInnerTolerance;
    problem.max_iterations = std::max(1, options.max_iterations / 10);
    const CgResult inner = conjugate_gradients(system, problem, tasks);
    const Quartic line = along_line(finest, kStep, step_board, options.penalty, tasks);
    const double length = descend(line);
    report.iterations += inner.iterations;
    report.passes += inner.passes + 1;
    if (!(length > 0.0)) {
      break;
    }
    take_step(finest, kStep, step_board, static_cast<float>(length), tasks);
    ++report.passes;
  }
  finest.store->erase(kStep.name);
}

template void newton_steps(SystemHierarchy<ComplexBlock>&, const SolveOptions&, SolveReport&,
                           TaskGraph&);
template void newton_steps(SystemHierarchy<PairBlock>&, const SolveOptions&, SolveReport&,
                           TaskGraph&);

}  // namespace rattan
