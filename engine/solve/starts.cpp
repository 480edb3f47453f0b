// SPDX-License-Identifier: MIT
#include "engine/solve/starts.h"

#include <algorithm>

#include "engine/core/parallel.h"

namespace rattan {

namespace {

template <class Block>
double unit_energy(const TileSystem<Block>& tile, const std::vector<NodeTerm<Block>>& terms,
                   std::vector<Value<Block>> x) {
  for (Value<Block>& v : x) {
    normalise<Block>(v);
  }
  double energy = 0.0;
  for (std::uint32_t i = 0; i < x.size(); ++i) {
    add_row_energy<Block>(tile, terms[i], i, x, energy);
  }
  return energy;
}

}  // namespace

template <class Block>
void relax_best(SystemLevel<Block>& fine, const std::vector<std::vector<Value<Block>>>& candidates,
                const SmoothPlan<Block>& plan, TaskGraph& tasks) {
  struct State {
    TileSystem<Block> tile;
    std::vector<Value<Block>> best;
    std::vector<PartNorms> norms;
  };
  const Level& level = *fine.level;
  ensure(level.layout.tile_count() == 1, "candidates are compared on one tile");
  run_pass<State>(
      tasks, "sweeps", 1,
      [&](TileId t, State& s) {
        s.tile.load(fine, t);
        s.tile.load_links(fine, t);
      },
      [&](TileId, State& s) {
        const std::vector<NodeTerm<Block>> terms = s.tile.terms(plan.penalty);
        std::vector<std::vector<Value<Block>>> x(candidates.size());
        std::vector<std::vector<PartNorms>> norms(candidates.size());
        std::vector<double> energy(candidates.size());
        parallel_indices(
            candidates.size(),
            [&](std::size_t c) {
              x[c] = prolong_owned<Block>(s.tile, candidates[c]);
              const auto go = [&](SweepMode mode, int count) {
                sweep_often<Block>(s.tile, terms, x[c], plan.omega, mode, count);
              };
              go(plan.mode, plan.passes * plan.sweeps);
              if (!plan.norms.name.empty()) {
                norms[c] = part_norms<Block>(x[c], x[c].size());
              }
              go(SweepMode::kUnit, plan.unit_sweeps);
              energy[c] = unit_energy(s.tile, terms, x[c]);
            },
            1);
        const auto least = std::min_element(energy.begin(), energy.end());
        s.best = std::move(x[static_cast<std::size_t>(least - energy.begin())]);
        s.norms = std::move(norms[static_cast<std::size_t>(least - energy.begin())]);
        if (plan.normalise) {
          for (Value<Block>& v : s.best) {
            normalise<Block>(v);
          }
        }
      },
      [&](TileId t, State& s) {
        write(*fine.store, plan.values, t, s.best);
        if (!plan.norms.name.empty()) {
          write(*fine.store, plan.norms, t, s.norms);
        }
      },
      level.pass_over());
  plan.board->assign(level.layout.border_count, zero_value<Block>());
}

template void relax_best(SystemLevel<ComplexBlock>&,
                         const std::vector<std::vector<Value<ComplexBlock>>>&,
                         const SmoothPlan<ComplexBlock>&, TaskGraph&);
template void relax_best(SystemLevel<PairBlock>&, const std::vector<std::vector<Value<PairBlock>>>&,
                         const SmoothPlan<PairBlock>&, TaskGraph&);

}  // namespace rattan
