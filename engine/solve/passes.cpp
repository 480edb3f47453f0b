// SPDX-License-Identifier: MIT
#include "engine/solve/passes.h"

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
std::array<double, 2> smooth(SystemLevel<Block>& fine, const SystemLevel<Block>* coarse,
                             const SmoothPlan<Block>& plan, TaskGraph& tasks) {
  struct State {
    TileSystem<Block> tile;
    ChunkView<Value<Block>> stored, coarse, rhs, at;
    std::array<ChunkView<Value<Block>>, 2> other;
    std::vector<Value<Block>> x;
    std::array<double, 2> dots{};
  };
  std::array<double, 2> dots{};
  const Level& level = *fine.level;
  HaloBoard<Value<Block>> before = start_board(fine, coarse, plan);
  HaloBoard<Value<Block>> after(before.size());
  for (int pass = 0; pass < plan.passes; ++pass) {
    const Start start = pass == 0 ? plan.start : Start::kStored;
    const bool last = pass + 1 == plan.passes;
    run_pass<State>(
        tasks, "sweeps", level.layout.tile_count(),
        [&](TileId t, State& s) {
          s.tile.load(fine, t);
          if (start == Start::kStored) {
            s.stored = read(*fine.store, plan.values, t);
          } else if (start == Start::kProlong) {
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
        },
        [&](TileId, State& s) {
          const std::uint32_t owned = s.tile.extent.owned;
          std::vector<NodeTerm<Block>> terms = s.tile.terms(plan.penalty);
          for (std::size_t i = 0; i < s.rhs.size(); ++i) {
            terms[i].rhs = s.rhs[i];
          }
          if (start == Start::kStored) {
            s.x.assign(s.stored.begin(), s.stored.end());
          } else if (start == Start::kProlong) {
            s.x = prolong_owned(s.tile, s.coarse.span());
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
            for (int k = 0; k < count; ++k) {
              sweep<Block>(terms, s.tile.row_begin.span(), s.tile.neighbor.span(),
                           s.tile.coefficient.span(), s.x, plan.omega, mode,
                           plan.symmetric && k % 2 == 1, s.at.span());
            }
          };
          go(plan.mode, plan.sweeps);
          if constexpr (BlockOps<Block>::kPeriodic) {
            if (last) {
              go(SweepMode::kUnit, plan.unit_sweeps);
            }
          }
          s.x.resize(owned);
          if (last && plan.normalise) {
            for (Value<Block>& v : s.x) {
              normalise<Block>(v);
            }
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
          write(*fine.store, plan.values, t, s.x);
          publish_border<Value<Block>>(s.x, s.tile.border.span(), s.tile.extent.border_first,
                                       after);
        },
        level.pass_over());
    std::swap(before, after);
  }
  *plan.board = std::move(before);
  return dots;
}

template <class Block>
void restrict_down(SystemHierarchy<Block>& system, std::size_t from,
                   Field<Value<Block>> SystemLevel<Block>::*field, TaskGraph& tasks) {
  struct State {
    TileSystem<Block> tile;
    ChunkView<Value<Block>> values;
    std::vector<Value<Block>> sums;
  };
  for (std::size_t k = from; k + 1 < system.levels.size(); ++k) {
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
        for (std::uint32_t i = 0; i < st.tile.extent.owned; ++i) {
          const NodeTerm<Block>& term = terms[i];
          st.sum.targets += st.tile.target_energy(i);
          const auto row = row_product<Block>(st.tile, i, x);
          const float* xi = reals<Block>(x[i]);
          std::array<double, Ops::kParts> excess{};
          if constexpr (Ops::kPeriodic) {
            for (std::size_t p = 0; p < Ops::kParts; ++p) {
              const double re = xi[2 * p];
              const double im = xi[2 * p + 1];
              excess[p] = re * re + im * im - 1.0;
              st.sum.energy += term.eps * excess[p] * excess[p];
            }
          }
          for (std::size_t k = 0; k < Ops::kReals; ++k) {
            const double d = term.diagonal[part_of<Block>(k)];
            const double b = reals<Block>(term.rhs)[k];
            st.sum.energy += xi[k] * (d * xi[k] - row[k] - 2.0 * b);
            const double g =
                2.0 * (d * xi[k] - row[k] - b) + 4.0 * term.eps * excess[part_of<Block>(k)] * xi[k];
            st.sum.gradient_norm += g * g;
          }
          if constexpr (Ops::kPeriodic) {
            add_row_energy<Block>(st.tile, term, i, unit_x, st.sum.energy_unit);
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
  template std::array<double, 2> smooth(SystemLevel<Block>&, const SystemLevel<Block>*,            \
                                        const SmoothPlan<Block>&, TaskGraph&);                     \
  template void restrict_down(SystemHierarchy<Block>&, std::size_t,                                \
                              Field<Value<Block>> SystemLevel<Block>::*, TaskGraph&);              \
  template Evaluation evaluate(const SystemLevel<Block>&, float, TaskGraph&);
RATTAN_FOR_EACH_BLOCK(RATTAN_INSTANTIATE)
#undef RATTAN_INSTANTIATE

}  // namespace rattan
