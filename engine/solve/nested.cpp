// SPDX-License-Identifier: MIT
//
// Periodic systems: nested iteration. The coarsest level starts from random unit values and relaxes
// until it has settled; each finer level starts from the coarser one's answer carried along the
// gauges. Real systems: conjugate gradients preconditioned by the same levels.

#include "engine/solve/conjugate_gradient.h"
#include "engine/solve/newton.h"
#include "engine/solve/passes.h"

namespace rattan {

namespace {

constexpr float kOverRelaxation = 1.5F;
/// Several random starts climb from the coarsest level to the finest of at most kTrialNodes nodes,
/// where the one of least energy goes on: a start decides which way phases wind around handles and
/// where vortices settle, and no finer level can undo that. Large scans average it out by
/// themselves.
constexpr std::uint64_t kStarts = 4;
constexpr std::uint64_t kTrialNodes = 2048;
constexpr int kCoarsestSweeps = 512;
constexpr int kCoarseSweeps = 64;
constexpr int kSecondLevelSweeps = 16;
/// Sweeps between exchanges of halos on coarse levels of several tiles.
constexpr int kSweepsPerPass = 4;
constexpr int kUnitSweeps = 3;

/// Relaxes level k from its start: a seed on the coarsest, else the coarser level's answer.
template <class Block>
void relax_level(SystemHierarchy<Block>& system, std::size_t k, std::uint64_t seed,
                 const SolveOptions& options, SolveReport& report, TaskGraph& tasks) {
  const std::size_t coarsest = system.levels.size() - 1;
  SystemLevel<Block>& s = system.levels[k];
  SmoothPlan<Block> plan;
  plan.omega = kOverRelaxation;
  plan.penalty = options.penalty;
  plan.values = s.solution;
  plan.board = &s.board;
  const bool one_tile = s.level->layout.tile_count() <= 1;
  const auto split = [&](int sweeps) {
    plan.passes = one_tile ? 1 : sweeps / kSweepsPerPass;
    plan.sweeps = one_tile ? sweeps : kSweepsPerPass;
  };
  if (k == coarsest) {
    plan.start = Start::kSeed;
    plan.seed = seed;
    split(kCoarsestSweeps);
    smooth<Block>(s, nullptr, plan, tasks);
    if (k == 0) {
      report.passes += static_cast<std::uint64_t>(plan.passes);
      report.iterations += static_cast<std::uint64_t>(plan.passes * plan.sweeps);
      plan.start = Start::kStored;
    }
  } else {
    plan.start = Start::kProlong;
    plan.coarse_values = system.levels[k + 1].solution;
  }
  if (k == 0) {
    const bool unit = options.unit_norm && options.newton_steps == 0;
    plan.passes = std::max(options.passes, 1);
    plan.sweeps = options.sweeps;
    plan.unit_sweeps = unit ? kUnitSweeps : 0;
    plan.normalise = unit;
    report.passes += static_cast<std::uint64_t>(plan.passes);
    report.iterations += static_cast<std::uint64_t>(plan.passes * plan.sweeps + plan.unit_sweeps);
    smooth<Block>(s, k == coarsest ? nullptr : &system.levels[k + 1], plan, tasks);
  } else if (k < coarsest) {
    split(k == 1 ? kSecondLevelSweeps : kCoarseSweeps);
    smooth<Block>(s, &system.levels[k + 1], plan, tasks);
  }
}

template <class Block>
void solve_periodic(SystemHierarchy<Block>& system, const SolveOptions& options,
                    SolveReport& report, TaskGraph& tasks) {
  const std::size_t coarsest = system.levels.size() - 1;
  std::size_t trial = coarsest;
  while (trial > 1 && system.levels[trial - 1].level->layout.node_count <= kTrialNodes) {
    --trial;
  }
  const auto climb = [&](std::uint64_t seed) {
    for (std::size_t k = coarsest + 1; k-- > trial;) {
      relax_level(system, k, seed, options, report, tasks);
    }
  };
  std::uint64_t best = 0;
  double least = 0.0;
  for (std::uint64_t seed = 0; seed < kStarts; ++seed) {
    climb(seed);
    const double energy = evaluate(system.levels[trial], options.penalty, tasks).energy;
    report.passes += trial == 0 ? 1 : 0;
    if (seed == 0 || energy < least) {
      least = energy;
      best = seed;
    }
  }
  if (best != kStarts - 1) {
    climb(best);
  }
  for (std::size_t k = trial; k-- > 0;) {
    relax_level(system, k, 0, options, report, tasks);
  }
  if (options.newton_steps > 0) {
    newton_steps<Block>(system, options, report, tasks);
    if (options.unit_norm) {
      SystemLevel<Block>& s = system.levels[0];
      SmoothPlan<Block> plan;
      plan.sweeps = 0;
      plan.unit_sweeps = kUnitSweeps;
      plan.normalise = true;
      plan.values = s.solution;
      plan.board = &s.board;
      smooth<Block>(s, nullptr, plan, tasks);
      ++report.passes;
    }
  }
}

}  // namespace

template <class Block>
SolveReport solve_nested(Store& store, const TileLayout& layout, const HaloFields&,
                         const SystemFields<Block>& fields, const Hierarchy& hierarchy,
                         const SolveOptions& options, TaskGraph& tasks) {
  ensure(layout.node_count == hierarchy.levels[0].layout.node_count,
         "the hierarchy was built for this layout");
  SolveReport report;
  report.unknowns = layout.node_count * BlockOps<Block>::kReals;
  if (layout.node_count == 0) {
    return report;
  }
  SystemHierarchy<Block> system;
  coarsen_system(system, store, fields, hierarchy, options.coarse_stiffness, tasks);
  report.setup_passes = system.finest_passes;
  if constexpr (BlockOps<Block>::kPeriodic) {
    solve_periodic(system, options, report, tasks);
  } else {
    solve_real(system, options, report, tasks);
  }
  SystemLevel<Block>& finest = system.levels[0];
  write(store, fields.solution, kBoardTile, finest.board);
  if (options.evaluate) {
    const Evaluation e =
        evaluate(finest, BlockOps<Block>::kPeriodic ? options.penalty : 0.0F, tasks);
    ++report.passes;
    report.energy = e.energy;
    report.energy_unit = e.energy_unit;
    report.gradient_norm = e.gradient_norm;
  }
  return report;
}

#define RATTAN_INSTANTIATE(Block)                                                 \
  template SolveReport solve_nested(Store&, const TileLayout&, const HaloFields&, \
                                    const SystemFields<Block>&, const Hierarchy&, \
                                    const SolveOptions&, TaskGraph&);
RATTAN_FOR_EACH_BLOCK(RATTAN_INSTANTIATE)
#undef RATTAN_INSTANTIATE

}  // namespace rattan
