// SPDX-License-Identifier: MIT
#include "engine/solve/finish.h"

namespace rattan {

template <class Block>
void settle_at_unit_norm(SystemLevel<Block>& finest, TaskGraph& tasks, Field<PartNorms> norms) {
  SmoothPlan<Block> plan;
  plan.sweeps = 0;
  plan.unit_sweeps = kUnitSweeps;
  plan.normalise = true;
  plan.norms = norms;
  plan.values = finest.solution;
  plan.board = &finest.board;
  smooth<Block>(finest, nullptr, plan, tasks);
}

template <class Block>
void finish_solve(const SystemLevel<Block>& finest, Store& store, const SolveOptions& options,
                  const std::optional<Evaluation>& evaluation, bool stored, SolveReport& report,
                  TaskGraph& tasks) {
  if (stored) {
    write(store, finest.solution, kBoardTile, finest.board);
  }
  if (!options.evaluate) {
    return;
  }
  report.passes += evaluation ? 0 : 1;
  const Evaluation e =
      evaluation ? *evaluation
                 : evaluate(finest, BlockOps<Block>::kPeriodic ? options.penalty : 0.0F, tasks);
  report.energy = e.energy + e.targets;
  report.energy_unit = e.energy_unit + e.targets;
  report.gradient_norm = e.gradient_norm;
}

#define RATTAN_INSTANTIATE(Block)                                                    \
  template void finish_solve(const SystemLevel<Block>&, Store&, const SolveOptions&, \
                             const std::optional<Evaluation>&, bool, SolveReport&, TaskGraph&);
RATTAN_FOR_EACH_BLOCK(RATTAN_INSTANTIATE)
#undef RATTAN_INSTANTIATE
template void settle_at_unit_norm(SystemLevel<ComplexBlock>&, TaskGraph&, Field<PartNorms>);
template void settle_at_unit_norm(SystemLevel<PairBlock>&, TaskGraph&, Field<PartNorms>);

}  // namespace rattan
