// SPDX-License-Identifier: MIT
#include "engine/solve/passes.h"

#include <algorithm>
#include <cmath>

#include "engine/core/exact_math.h"

namespace rattan {

namespace {

// The finaliser of splitmix64: an even spread of 64 bits.
std::uint64_t mix(std::uint64_t z) {
  z += 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27U)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31U);
}

template <class Block>
Value<Block> seed_value(std::uint64_t seed, std::uint64_t node) {
  Value<Block> v = zero_value<Block>();
  if constexpr (BlockOps<Block>::kPeriodic) {
    for (std::size_t p = 0; p < BlockOps<Block>::kParts; ++p) {
      const double unit_interval =
          static_cast<double>(mix(mix(seed) + 2 * node + p) >> 11U) * 0x1p-53;
      const exact::SinCos a = exact::sincos(2.0 * exact::kPi * unit_interval);
      reals<Block>(v)[2 * p] = static_cast<float>(a.cos);
      reals<Block>(v)[2 * p + 1] = static_cast<float>(a.sin);
    }
  }
  return v;
}

// Where kCorrect starts from, before prolongation.
template <class Block>
Value<Block> stepped(const SmoothPlan<Block>& plan, const Value<Block>& stored,
                     const Value<Block>& base) {
  Value<Block> out = base;
  add_scaled<Block>(out, plan.step, stored);
  add_scaled<Block>(out, -plan.step, base);
  return out;
}

template <class Block>
HaloBoard<Value<Block>> start_board(const SystemLevel<Block>& fine,
                                    const SystemLevel<Block>* coarse,
                                    const SmoothPlan<Block>& plan) {
  if (plan.start == Start::kProlong) {
    return prolong_border(fine, *coarse, plan.coarse_values);
  }
  if (plan.start == Start::kStored) {
    return *plan.board;
  }
  if (plan.start == Start::kCorrect) {
    HaloBoard<Value<Block>> board = prolong_border(fine, *coarse, plan.coarse_values);
    for (std::size_t k = 0; k < board.size(); ++k) {
      const Value<Block> at =
          stepped(plan, (*plan.board)[k], plan.based ? (*plan.base_board)[k] : zero_value<Block>());
      add_scaled<Block>(board[k], 1.0F, at);
      if (!plan.final) {
        (*plan.base_board)[k] = at;
      }
    }
    return board;
  }
  const Level& level = *fine.level;
  HaloBoard<Value<Block>> board(level.layout.border_count, zero_value<Block>());
  if (plan.start == Start::kZero) {
    return board;
  }
  for (std::uint32_t t = 0; t < level.layout.tile_count(); ++t) {
    const TileExtent& e = level.layout.tiles[t];
    const auto border = read(*level.store, level.halo.border, TileId(t));
    for (std::uint32_t k = 0; k < e.border; ++k) {
      board[e.border_first + k] = seed_value<Block>(plan.seed, e.first + border[k]);
    }
  }
  return board;
}

// Energy and squared gradient of a tile's own nodes at `x` (owned, then halo), without energy_unit.
// With `across`: products with halo values, which are to change, are left out of the energy, and
// the sum over halo nodes j of <across_j, x_j> is what they come to.
template <class Block>
void add_tile(const TileSystem<Block>& tile, const std::vector<NodeTerm<Block>>& terms,
              std::span<const Value<Block>> x, Evaluation& sum, std::vector<Value<Block>>* across) {
  using Ops = BlockOps<Block>;
  const std::uint32_t owned = tile.extent.owned;
  for (std::uint32_t i = 0; i < owned; ++i) {
    const NodeTerm<Block>& term = terms[i];
    sum.targets += tile.target_energy(i);
    const auto row = row_product<Block>(tile, i, x);
    const float* xi = reals<Block>(x[i]);
    std::array<double, Ops::kParts> excess{};
    if constexpr (Ops::kPeriodic) {
      for (std::size_t p = 0; p < Ops::kParts; ++p) {
        const double re = xi[2 * p];
        const double im = xi[2 * p + 1];
        excess[p] = re * re + im * im - 1.0;
        sum.energy += term.eps * excess[p] * excess[p];
      }
    }
    for (std::size_t k = 0; k < Ops::kReals; ++k) {
      const double d = term.diagonal[part_of<Block>(k)];
      const double b = reals<Block>(term.rhs)[k];
      sum.energy += xi[k] * (d * xi[k] - row[k] - 2.0 * b);
      const double g =
          2.0 * (d * xi[k] - row[k] - b) + 4.0 * term.eps * excess[part_of<Block>(k)] * xi[k];
      sum.gradient_norm += g * g;
    }
    if (across == nullptr) {
      continue;
    }
    for (std::uint32_t e = tile.row_begin[i]; e < tile.row_begin[i + 1]; ++e) {
      const std::uint32_t j = tile.neighbor[e];
      if (j >= owned) {
        const Value<Block> back = apply<Block>(Ops::adjoint(tile.coefficient[e]), x[i]);
        add_scaled<Block>((*across)[j - owned], 1.0F, back);
        sum.energy += dot<Block>(back, x[j]);
      }
    }
  }
}

}  // namespace

template <class Block>
std::vector<Value<Block>> prolong_owned(const TileSystem<Block>& tile,
                                        std::span<const Value<Block>> coarse) {
  std::vector<Value<Block>> out(tile.extent.owned);
  for (std::uint32_t i = 0; i < tile.extent.owned; ++i) {
    if constexpr (BlockOps<Block>::kPeriodic) {
      out[i] = apply<Block>(tile.gauge(i), coarse[tile.parent[i]]);
    } else {
      out[i] = coarse[tile.parent[i]];
    }
  }
  return out;
}

template <class Block>
std::vector<Value<Block>> restrict_owned(const TileSystem<Block>& tile, std::uint32_t first_parent,
                                         std::uint32_t parents,
                                         std::span<const Value<Block>> values) {
  using Ops = BlockOps<Block>;
  std::vector<Value<Block>> out(parents, zero_value<Block>());
  for (std::uint32_t i = 0; i < tile.extent.owned; ++i) {
    Value<Block>& to = out[tile.parent[i] - first_parent];
    if constexpr (Ops::kPeriodic) {
      Ops::apply_add(Ops::adjoint(tile.gauge(i)), reals<Block>(values[i]), reals<Block>(to));
    } else {
      add_scaled<Block>(to, 1.0F, values[i]);
    }
  }
  return out;
}

template <class Block>
void CoarseWriter<Block>::add(TileId tile, const std::vector<Value<Block>>& piece) {
  const Level& level = *fine_.level;
  chunk_.insert(chunk_.end(), piece.begin(), piece.end());
  const std::uint32_t c = level.coarse_tile[tile.value];
  if (tile.value + 1 == level.group[c + 1]) {
    write(*coarse_.store, field_, TileId(c), chunk_);
    chunk_.clear();
  }
}

template <class Block>
std::vector<PartNorms> part_norms(std::span<const Value<Block>> x, std::size_t count) {
  std::vector<PartNorms> norms(count);
  if constexpr (BlockOps<Block>::kPeriodic) {
    constexpr std::size_t kLast = BlockOps<Block>::kParts - 1;
    for (std::size_t i = 0; i < count; ++i) {
      const float* r = reals<Block>(x[i]);
      for (std::size_t p = 0; p < 2; ++p) {
        const float* part = r + 2 * std::min(p, kLast);
        norms[i][p] = std::sqrt(part[0] * part[0] + part[1] * part[1]);
      }
    }
  }
  return norms;
}

template <class Block>
std::array<double, 2> smooth(SystemLevel<Block>& fine, const SystemLevel<Block>* coarse,
                             const SmoothPlan<Block>& plan, TaskGraph& tasks) {
  struct State {
    TileSystem<Block> tile;
    ChunkView<Value<Block>> stored, base, coarse, rhs, at;
    std::array<ChunkView<Value<Block>>, 2> other;
    std::vector<Value<Block>> x, across, next_base;
    std::vector<PartNorms> norms;
    std::array<double, 2> dots{};
    Evaluation sum;
    std::unique_ptr<SolutionTask<Block>> consumer;
  };
  std::array<double, 2> dots{};
  Evaluation total;
  const bool consumes = plan.hooks != nullptr && plan.hooks->consume;
  const Level& level = *fine.level;
  if (plan.start == Start::kCorrect && !plan.based && !plan.final) {
    plan.base_board->resize(level.layout.border_count);
  }
  HaloBoard<Value<Block>> before = start_board(fine, coarse, plan);
  HaloBoard<Value<Block>> after(before.size());
  HaloBoard<Value<Block>> across(plan.evaluation != nullptr ? before.size() : 0,
                                 zero_value<Block>());
  for (int pass = 0; pass < plan.passes; ++pass) {
    const Start start = pass == 0 ? plan.start : Start::kStored;
    const bool last = pass + 1 == plan.passes;
    run_pass<State>(
        tasks, "sweeps", level.layout.tile_count(),
        [&](TileId t, State& s) {
          s.tile.load(fine, t);
          if (start == Start::kStored || start == Start::kCorrect) {
            s.stored = read(*fine.store, plan.values, t);
          }
          if (start == Start::kCorrect && plan.based) {
            s.base = read(*fine.store, plan.base, t);
          }
          if (start == Start::kProlong || start == Start::kCorrect) {
            s.tile.load_links(fine, t);
            s.coarse = read(*coarse->store, plan.coarse_values, TileId(level.coarse_tile[t.value]));
          }
          if (!plan.rhs.name.empty()) {
            s.rhs = read(*fine.store, plan.rhs, t);
          }
          for (std::size_t k = 0; k < 2; ++k) {
            if (last && !plan.dot_with[k].name.empty()) {
              s.other[k] = read(*fine.store, plan.dot_with[k], t);
            }
          }
          if (plan.mode == SweepMode::kNewton) {
            s.at = read(*fine.store, fine.solution, t);
          }
          if (last && consumes) {
            s.consumer = plan.hooks->consume(t);
            s.consumer->load();
          }
        },
        [&](TileId, State& s) {
          const std::uint32_t owned = s.tile.extent.owned;
          std::vector<NodeTerm<Block>> terms = s.tile.terms(plan.penalty);
          for (std::size_t i = 0; i < s.rhs.size(); ++i) {
            terms[i].rhs = s.rhs[i];
          }
          if (start == Start::kStored) {
            s.x.assign(s.stored.begin(), s.stored.end());
          } else if (start == Start::kProlong || start == Start::kCorrect) {
            s.x = prolong_owned(s.tile, s.coarse.span());
            for (std::size_t i = 0; i < s.stored.size(); ++i) {
              const Value<Block> at =
                  stepped(plan, s.stored[i], s.base.size() != 0 ? s.base[i] : zero_value<Block>());
              add_scaled<Block>(s.x[i], 1.0F, at);
              if (!plan.final) {
                s.next_base.push_back(at);
              }
            }
          } else if (start == Start::kZero) {
            s.x.assign(owned, zero_value<Block>());
          } else {
            for (std::uint32_t i = 0; i < owned; ++i) {
              s.x.push_back(seed_value<Block>(plan.seed, s.tile.extent.first + i));
            }
          }
          for (const std::uint32_t slot : s.tile.halo_slots) {
            s.x.push_back(before[slot]);
          }
          const auto go = [&](SweepMode mode, int count) {
            sweep_often<Block>(s.tile, terms, s.x, plan.omega, mode, count, plan.symmetric,
                               s.at.span());
          };
          go(plan.mode, plan.sweeps);
          if constexpr (BlockOps<Block>::kPeriodic) {
            if (last && !plan.norms.name.empty()) {
              s.norms = part_norms<Block>(s.x, owned);
            }
            if (last) {
              go(SweepMode::kUnit, plan.unit_sweeps);
            }
          }
          if (last && plan.normalise) {
            for (std::uint32_t i = 0; i < owned; ++i) {
              normalise<Block>(s.x[i]);
            }
          }
          if (last && plan.evaluation != nullptr) {
            s.across.assign(s.tile.extent.halo, zero_value<Block>());
            add_tile<Block>(s.tile, terms, s.x, s.sum, &s.across);
          }
          s.x.resize(owned);
          if (s.consumer != nullptr) {
            s.consumer->compute(s.x);
          }
          for (std::size_t k = 0; k < 2; ++k) {
            for (std::size_t i = 0; i < s.other[k].size(); ++i) {
              s.dots[k] += dot<Block>(s.x[i], s.other[k][i]);
            }
          }
        },
        [&](TileId t, State& s) {
          dots[0] += s.dots[0];
          dots[1] += s.dots[1];
          if (s.consumer != nullptr) {
            s.consumer->commit();
          } else {
            write(*fine.store, plan.values, t, s.x);
          }
          if (start == Start::kCorrect && !plan.final) {
            write(*fine.store, plan.base, t, s.next_base);
          }
          if (!s.norms.empty()) {
            write(*fine.store, plan.norms, t, s.norms);
          }
          total.energy += s.sum.energy;
          total.targets += s.sum.targets;
          total.gradient_norm += s.sum.gradient_norm;
          for (std::size_t k = 0; k < s.across.size(); ++k) {
            add_scaled<Block>(across[s.tile.halo_slots[k]], 1.0F, s.across[k]);
          }
          publish_border<Value<Block>>(s.x, s.tile.border.span(), s.tile.extent.border_first,
                                       after);
        },
        level.pass_over());
    std::swap(before, after);
  }
  *plan.board = std::move(before);
  if (plan.hooks != nullptr) {
    plan.hooks->consumed = plan.hooks->consumed || consumes;
  }
  if (plan.evaluation != nullptr) {
    for (std::size_t k = 0; k < across.size(); ++k) {
      total.energy -= dot<Block>(across[k], (*plan.board)[k]);
    }
    total.energy_unit = total.energy;
    total.gradient_norm = std::sqrt(total.gradient_norm);
    *plan.evaluation = total;
  }
  return dots;
}

template <class Block>
void restrict_once(SystemHierarchy<Block>& system, std::size_t k,
                   Field<Value<Block>> SystemLevel<Block>::*field, TaskGraph& tasks) {
  struct State {
    TileSystem<Block> tile;
    ChunkView<Value<Block>> values;
    std::vector<Value<Block>> sums;
  };
  SystemLevel<Block>& fine = system.levels[k];
  SystemLevel<Block>& coarse = system.levels[k + 1];
  const Level& level = *fine.level;
  CoarseWriter<Block> writer(fine, coarse, coarse.*field);
  run_pass<State>(
      tasks, "restriction", level.layout.tile_count(),
      [&](TileId t, State& s) {
        s.tile.load(fine, t);
        s.tile.load_links(fine, t);
        s.values = read(*fine.store, fine.*field, t);
      },
      [&](TileId t, State& s) {
        s.sums = restrict_owned(s.tile, level.first_parent[t.value], level.parents[t.value],
                                s.values.span());
      },
      [&](TileId t, State& s) { writer.add(t, s.sums); }, level.pass_over());
}

template <class Block>
void restrict_down(SystemHierarchy<Block>& system, std::size_t from,
                   Field<Value<Block>> SystemLevel<Block>::*field, TaskGraph& tasks) {
  for (std::size_t k = from; k + 1 < system.levels.size(); ++k) {
    restrict_once(system, k, field, tasks);
  }
}

template <class Block>
double restrict_residual(SystemLevel<Block>& fine, SystemLevel<Block>& coarse,
                         Field<Value<Block>> values, const HaloBoard<Value<Block>>& board,
                         Field<Value<Block>> rhs, const std::function<double(double)>& sample,
                         TaskGraph& tasks) {
  using Ops = BlockOps<Block>;
  static_assert(!Ops::kPeriodic);
  struct State {
    TileSystem<Block> tile;
    ChunkView<Value<Block>> x, rhs;
    std::vector<Value<Block>> sums;
    double sampled = 0.0;
    double fit = 0.0;
  };
  const Level& level = *fine.level;
  CoarseWriter<Block> writer(fine, coarse, coarse.residual);
  double sampled = 0.0;
  double fit = 0.0;
  run_pass<State>(
      tasks, "residual", level.layout.tile_count(),
      [&](TileId t, State& s) {
        s.tile.load(fine, t);
        s.tile.load_links(fine, t);
        s.x = read(*fine.store, values, t);
        if (!rhs.name.empty()) {
          s.rhs = read(*fine.store, rhs, t);
        }
      },
      [&](TileId t, State& s) {
        const std::vector<Value<Block>> x = gather_local(s.x.span(), s.tile.halo_slots, board);
        std::vector<Value<Block>> residual(s.tile.extent.owned);
        for (std::uint32_t i = 0; i < s.tile.extent.owned; ++i) {
          const auto row = row_product<Block>(s.tile, i, x);
          const double d = static_cast<double>(s.tile.stiffness(i, 0)) + s.tile.fit_of(i);
          const Value<Block> b = s.rhs.size() != 0 ? s.rhs[i] : s.tile.rhs_of(i);
          for (std::size_t k = 0; k < Ops::kReals; ++k) {
            reals<Block>(residual[i])[k] =
                static_cast<float>(reals<Block>(b)[k] - (d * reals<Block>(x[i])[k] - row[k]));
          }
          if (sample) {
            const double weight = s.tile.fit_of(i);
            s.fit += weight;
            s.sampled += weight * sample(reals<Block>(x[i])[0]);
          }
        }
        s.sums = restrict_owned<Block>(s.tile, level.first_parent[t.value], level.parents[t.value],
                                       residual);
      },
      [&](TileId t, State& s) {
        writer.add(t, s.sums);
        sampled += s.sampled;
        fit += s.fit;
      },
      level.pass_over());
  return fit > 0.0 ? sampled / fit : 0.0;
}

template <class Block>
Evaluation evaluate(const SystemLevel<Block>& s, float penalty, TaskGraph& tasks) {
  using Ops = BlockOps<Block>;
  struct State {
    TileSystem<Block> tile;
    ChunkView<Value<Block>> x;
    Evaluation sum;
  };
  Evaluation total;
  run_pass<State>(
      tasks, "evaluation", s.level->layout.tile_count(),
      [&](TileId t, State& st) {
        st.tile.load(s, t);
        st.x = read(*s.store, s.solution, t);
      },
      [&](TileId, State& st) {
        const std::vector<Value<Block>> x = gather_local(st.x.span(), st.tile.halo_slots, s.board);
        std::vector<Value<Block>> unit_x = x;
        for (Value<Block>& v : unit_x) {
          normalise<Block>(v);
        }
        const std::vector<NodeTerm<Block>> terms = st.tile.terms(penalty);
        add_tile<Block>(st.tile, terms, x, st.sum, nullptr);
        if constexpr (Ops::kPeriodic) {
          for (std::uint32_t i = 0; i < st.tile.extent.owned; ++i) {
            add_row_energy<Block>(st.tile, terms[i], i, unit_x, st.sum.energy_unit);
          }
        }
      },
      [&](TileId, State& st) {
        total.energy += st.sum.energy;
        total.targets += st.sum.targets;
        total.energy_unit += st.sum.energy_unit;
        total.gradient_norm += st.sum.gradient_norm;
      },
      s.level->pass_over());
  total.gradient_norm = std::sqrt(total.gradient_norm);
  if constexpr (!Ops::kPeriodic) {
    total.energy_unit = total.energy;
  }
  return total;
}

#define RATTAN_INSTANTIATE(Block)                                                                  \
  template std::vector<Value<Block>> prolong_owned(const TileSystem<Block>&,                       \
                                                   std::span<const Value<Block>>);                 \
  template std::vector<Value<Block>> restrict_owned(const TileSystem<Block>&, std::uint32_t,       \
                                                    std::uint32_t, std::span<const Value<Block>>); \
  template class CoarseWriter<Block>;                                                              \
  template std::vector<PartNorms> part_norms<Block>(std::span<const Value<Block>>, std::size_t);   \
  template std::array<double, 2> smooth(SystemLevel<Block>&, const SystemLevel<Block>*,            \
                                        const SmoothPlan<Block>&, TaskGraph&);                     \
  template void restrict_once(SystemHierarchy<Block>&, std::size_t,                                \
                              Field<Value<Block>> SystemLevel<Block>::*, TaskGraph&);              \
  template void restrict_down(SystemHierarchy<Block>&, std::size_t,                                \
                              Field<Value<Block>> SystemLevel<Block>::*, TaskGraph&);              \
  template Evaluation evaluate(const SystemLevel<Block>&, float, TaskGraph&);
RATTAN_FOR_EACH_BLOCK(RATTAN_INSTANTIATE)
#undef RATTAN_INSTANTIATE

}  // namespace rattan
