// SPDX-License-Identifier: MIT
//
// Periodic systems: nested iteration. The coarsest level starts from random unit values and relaxes
// until it has settled; each finer level starts from the coarser one's answer carried along the
// gauges. Real systems: conjugate gradients preconditioned by the same levels.

#include <optional>
#include <utility>

#include "engine/solve/coarsest_solver.h"
#include "engine/solve/conjugate_gradient.h"
#include "engine/solve/cycles.h"
#include "engine/solve/finish.h"
#include "engine/solve/newton.h"
#include "engine/solve/starts.h"

namespace rattan {

namespace {

constexpr float kOverRelaxation = 1.5F;
/// Random starts climb from the coarsest level to the finest of at most kTrialNodes nodes, where
/// the one of least energy goes on: a start decides which way phases wind around handles and where
/// vortices settle, and no finer level can undo that. Large scans average it out by themselves.
constexpr std::uint64_t kTrialNodes = 2048;
constexpr int kCoarsestSweeps = 128;
constexpr int kCoarseSweeps = 16;
constexpr int kSecondLevelSweeps = 8;
/// Sweeps between exchanges of halos on coarse levels of several tiles.
constexpr int kSweepsPerPass = 4;

template <class Block>
class Periodic {
 public:
  Periodic(SystemHierarchy<Block>& system, const SolveOptions& options, SolveHooks<Block>* hooks,
           std::optional<Evaluation>& evaluation, SolveReport& report, TaskGraph& tasks)
      : system_(system),
        options_(options),
        hooks_(hooks),
        evaluation_(evaluation),
        report_(report),
        tasks_(tasks),
        coarsest_(system.levels.size() - 1) {}

  void solve() {
    if (trial_level() == 1 && system_.levels[0].level->layout.tile_count() == 1) {
      solve_one_tile();
    } else {
      solve_coarse();
      solve_finest();
    }
    if (options_.newton_steps > 0) {
      newton_steps<Block>(system_, options_, report_, tasks_);
      if (options_.unit_norm) {
        settle_at_unit_norm(system_.levels[0], tasks_, options_.norms);
        ++report_.passes;
      }
    }
  }

  // Down to the finest level's start. The start that is best on the trial level goes on.
  void solve_coarse() {
    const std::size_t trial = trial_level();
    SystemLevel<Block>& top = system_.levels[trial];
    SavedSolution best;
    double least = 0.0;
    const auto starts = static_cast<std::uint64_t>(std::max(options_.starts, 1));
    for (std::uint64_t seed = 0; seed < starts; ++seed) {
      climb(trial, seed);
      const double energy = evaluate(system_.levels[trial], options_.penalty, tasks_).energy;
      report_.passes += trial == 0 ? 1 : 0;
      const bool last = seed + 1 == starts;
      if (seed == 0 || energy < least) {
        least = energy;
        if (!last) {
          best = save(top);
        }
      } else if (last) {
        restore(best, top);
      }
    }
    for (std::size_t k = trial; k-- > 1;) {
      relax_level(k, 0);
    }
  }

  void solve_finest() {
    if (coarsest_ > 0) {
      relax_level(0, 0);
    }
  }

 private:
  std::size_t trial_level() const {
    std::size_t trial = coarsest_;
    while (trial > 1 && system_.levels[trial - 1].level->layout.node_count <= kTrialNodes) {
      --trial;
    }
    return trial;
  }

  /// Of a level that is small enough to be tried several times.
  struct SavedSolution {
    std::vector<std::vector<Value<Block>>> tiles;
    HaloBoard<Value<Block>> board;
  };

  static SavedSolution save(const SystemLevel<Block>& s) {
    SavedSolution saved{.tiles = {}, .board = s.board};
    for (std::uint32_t t = 0; t < s.level->layout.tile_count(); ++t) {
      const auto values = read(*s.store, s.solution, TileId(t));
      saved.tiles.emplace_back(values.begin(), values.end());
    }
    return saved;
  }

  static void restore(SavedSolution& saved, SystemLevel<Block>& s) {
    for (std::uint32_t t = 0; t < saved.tiles.size(); ++t) {
      write(*s.store, s.solution, TileId(t), saved.tiles[t]);
    }
    s.board = std::move(saved.board);
  }

  // A small scan has too few nodes on any coarse level to tell starts apart: all go on to the
  // finest.
  void solve_one_tile() {
    std::vector<std::vector<Value<Block>>> candidates;
    const auto starts = static_cast<std::uint64_t>(std::max(options_.starts_of_one_tile, 1));
    for (std::uint64_t seed = 0; seed < starts; ++seed) {
      climb(1, seed);
      const SystemLevel<Block>& s = system_.levels[1];
      const auto values = read(*s.store, s.solution, TileId(0));
      candidates.emplace_back(values.begin(), values.end());
    }
    const SmoothPlan<Block> plan = finest_plan(Start::kProlong);
    relax_best(system_.levels[0], candidates, plan, tasks_);
    ++report_.passes;
    report_.iterations += static_cast<std::uint64_t>(plan.passes * plan.sweeps + plan.unit_sweeps);
  }

  void climb(std::size_t to, std::uint64_t seed) {
    for (std::size_t k = coarsest_ + 1; k-- > to;) {
      relax_level(k, seed);
    }
  }

  SmoothPlan<Block> finest_plan(Start start) {
    const bool unit = options_.unit_norm && options_.newton_steps == 0;
    SmoothPlan<Block> plan = coarse_plan(0, start);
    plan.passes = std::max(options_.passes, 1);
    plan.sweeps = options_.sweeps;
    plan.unit_sweeps = unit ? kUnitSweeps : 0;
    plan.normalise = unit;
    if (unit) {
      plan.norms = options_.norms;
    }
    return plan;
  }

  SmoothPlan<Block> coarse_plan(std::size_t k, Start start) {
    SystemLevel<Block>& s = system_.levels[k];
    SmoothPlan<Block> plan;
    plan.start = start;
    plan.omega = kOverRelaxation;
    plan.penalty = options_.penalty;
    plan.values = s.solution;
    plan.board = &s.board;
    if (start == Start::kProlong) {
      plan.coarse_values = system_.levels[k + 1].solution;
    }
    return plan;
  }

  // Relaxes level k from its start: a seed on the coarsest, else the coarser level's answer.
  void relax_level(std::size_t k, std::uint64_t seed) {
    SystemLevel<Block>& s = system_.levels[k];
    const SystemLevel<Block>* coarser = k == coarsest_ ? nullptr : &system_.levels[k + 1];
    const auto relax = [&](SmoothPlan<Block> plan, int sweeps) {
      const bool one_tile = s.level->layout.tile_count() <= 1;
      plan.passes = one_tile ? 1 : sweeps / kSweepsPerPass;
      plan.sweeps = one_tile ? sweeps : kSweepsPerPass;
      smooth<Block>(s, coarser, plan, tasks_);
      return plan;
    };
    if (k == coarsest_) {
      SmoothPlan<Block> plan = coarse_plan(k, Start::kSeed);
      plan.seed = seed;
      count_if_finest(k, relax(plan, kCoarsestSweeps));
    } else if (k > 0) {
      relax(coarse_plan(k, Start::kProlong), k == 1 ? kSecondLevelSweeps : kCoarseSweeps);
    }
    if (k == 0) {
      SmoothPlan<Block> plan = finest_plan(k == coarsest_ ? Start::kStored : Start::kProlong);
      if (plan.normalise && coarsest_ > 0) {
        plan.hooks = hooks_;
        if (options_.evaluate) {
          plan.evaluation = &evaluation_.emplace();
        }
      }
      smooth<Block>(s, coarser, plan, tasks_);
      count_if_finest(k, plan);
    }
  }

  void count_if_finest(std::size_t k, const SmoothPlan<Block>& plan) {
    if (k == 0) {
      report_.passes += static_cast<std::uint64_t>(plan.passes);
      report_.iterations +=
          static_cast<std::uint64_t>(plan.passes * plan.sweeps + plan.unit_sweeps);
    }
  }

  SystemHierarchy<Block>& system_;
  const SolveOptions& options_;
  SolveHooks<Block>* hooks_;
  std::optional<Evaluation>& evaluation_;
  SolveReport& report_;
  TaskGraph& tasks_;
  std::size_t coarsest_;
};

}  // namespace

template <class Block>
void consume_solution(Store& store, const TileLayout& layout, Field<Value<Block>> solution,
                      SolveHooks<Block>& hooks, TaskGraph& tasks) {
  struct State {
    std::unique_ptr<SolutionTask<Block>> task;
    ChunkView<Value<Block>> solution;
  };
  run_pass<State>(
      tasks, "solution", layout.tile_count(),
      [&](TileId t, State& s) {
        s.solution = read(store, solution, t);
        s.task = hooks.consume(t);
        s.task->load();
      },
      [&](TileId, State& s) { s.task->compute(s.solution.span()); },
      [&](TileId, State& s) { s.task->commit(); });
  hooks.consumed = true;
}

bool can_solve_coarse(const Hierarchy& hierarchy, const SolveOptions& options) {
  return hierarchy.levels.size() > 1 && hierarchy.levels[0].layout.tile_count() > 1 &&
         options.newton_steps == 0;
}

template <class Block>
CoarsePart solve_coarse(Store& store, const SystemFields<Block>& fields, const Hierarchy& hierarchy,
                        const SolveOptions& options, TaskGraph& tasks, SolveHooks<Block>& hooks) {
  ensure(can_solve_coarse(hierarchy, options), "the solve has two parts");
  SystemHierarchy<Block> system;
  coarsen_system(system, store, fields, hierarchy, options.coarse_stiffness, tasks,
                 std::move(hooks.border_gauges));
  SolveReport report;
  std::optional<Evaluation> evaluation;
  Periodic<Block>(system, options, nullptr, evaluation, report, tasks).solve_coarse();
  leave_coarse_answer(system, store);
  return {.done = true, .setup_passes = system.finest_passes};
}

template <class Block>
SolveReport solve_nested(Store& store, const TileLayout& layout, const HaloFields&,
                         const SystemFields<Block>& fields, const Hierarchy& hierarchy,
                         const SolveOptions& options, TaskGraph& tasks, SolveHooks<Block>* hooks) {
  ensure(layout.node_count == hierarchy.levels[0].layout.node_count,
         "the hierarchy was built for this layout");
  SolveReport report;
  report.unknowns = layout.node_count * BlockOps<Block>::kReals;
  if (layout.node_count == 0) {
    return report;
  }
  SystemHierarchy<Block> system;
  const bool begun = hooks != nullptr && hooks->coarse.done;
  if (begun) {
    take_coarse_answer(system, store, fields, hierarchy);
    report.setup_passes = hooks->coarse.setup_passes;
  } else {
    coarsen_system(
        system, store, fields, hierarchy, options.coarse_stiffness, tasks,
        hooks != nullptr ? std::move(hooks->border_gauges) : HaloBoard<Coefficient<Block>>());
    report.setup_passes = system.finest_passes;
  }
  std::optional<Evaluation> evaluation;
  if constexpr (BlockOps<Block>::kPeriodic) {
    Periodic<Block> periodic(system, options, hooks, evaluation, report, tasks);
    if (begun) {
      periodic.solve_finest();
    } else {
      periodic.solve();
    }
  } else if (options.cycles > 0 && !fields.rhs.name.empty() &&
             !CoarsestSolver(system.levels.back()).singular()) {
    const bool has_coarse = system.levels.size() > 1;
    Evaluation* wanted = options.evaluate && has_coarse ? &evaluation.emplace() : nullptr;
    solve_in_cycles(system, options, hooks, wanted, report, tasks);
  } else {
    solve_real(system, options, report, tasks);
  }
  const bool consumed = hooks != nullptr && hooks->consumed;
  if (consumed) {
    store.erase(fields.solution.name);
  }
  finish_solve(system.levels[0], store, options, evaluation, !consumed, report, tasks);
  return report;
}

#define RATTAN_INSTANTIATE(Block)                                                         \
  template SolveReport solve_nested(Store&, const TileLayout&, const HaloFields&,         \
                                    const SystemFields<Block>&, const Hierarchy&,         \
                                    const SolveOptions&, TaskGraph&, SolveHooks<Block>*); \
  template void consume_solution(Store&, const TileLayout&, Field<Value<Block>>,          \
                                 SolveHooks<Block>&, TaskGraph&);
RATTAN_FOR_EACH_BLOCK(RATTAN_INSTANTIATE)
#undef RATTAN_INSTANTIATE
template CoarsePart solve_coarse(Store&, const SystemFields<ComplexBlock>&, const Hierarchy&,
                                 const SolveOptions&, TaskGraph&, SolveHooks<ComplexBlock>&);
template CoarsePart solve_coarse(Store&, const SystemFields<PairBlock>&, const Hierarchy&,
                                 const SolveOptions&, TaskGraph&, SolveHooks<PairBlock>&);

}  // namespace rattan
