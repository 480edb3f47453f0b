// SPDX-License-Identifier: MIT
//
// Galerkin products over gauge-transported aggregates: with x_i = G_i x_I for the members i of I,
//   C_IJ = sum G_i* C_ij G_j,   D_I = sum D_i,   b_I = sum G_i* b_i.
// Terms between two members of one aggregate are self-edges of I. Those without a turn are
// quadratic forms Re(a)|U|^2 + Re(b)|V|^2 and move into the diagonal. Those with a turn stay,
// together with a plain self-edge of weight s = the sum of their norms that is also added to the
// diagonal: this changes no energy, and makes the node-wise update with the old value on the
// right-hand side a majorisation, so that sweeps still descend.

#include <algorithm>
#include <string>

#include "engine/solve/system_level.h"

namespace rattan {

namespace {

template <class Block>
struct CoarseRows {
  std::vector<std::uint32_t> row_begin{0};
  std::vector<std::uint32_t> neighbor;
  std::vector<Coefficient<Block>> coefficient;
  std::vector<CoarseTerm<Block>> term;
};

// Between solve_coarse and the rest.
template <class Block>
constexpr Field<Value<Block>> kCoarseSolution{"solve/coarse_solution"};
template <class Block>
constexpr Field<Coefficient<Block>> kCoarseGauges{"solve/coarse_gauge"};

template <class Block>
struct GalerkinState {
  std::vector<TileSystem<Block>> fine;
  CoarseRows<Block> rows;
};

// Border gauges: what a tile must know of its neighbours before it can transport their values.
template <class Block>
void publish_gauges(SystemLevel<Block>& fine, TaskGraph& tasks) {
  struct State {
    TileSystem<Block> tile;
    std::vector<Coefficient<Block>> gauges;
  };
  const Level& level = *fine.level;
  fine.border_gauge.resize(level.layout.border_count);
  run_pass<State>(
      tasks, "gauges", level.layout.tile_count(),
      [&](TileId t, State& s) {
        s.tile.load(fine, t);
        s.tile.load_links(fine, t);
      },
      [&](TileId, State& s) {
        for (const std::uint32_t b : s.tile.border) {
          s.gauges.push_back(s.tile.gauge(b));
        }
      },
      [&](TileId t, State& s) {
        std::copy(s.gauges.begin(), s.gauges.end(),
                  fine.border_gauge.begin() +
                      static_cast<std::ptrdiff_t>(level.layout.tiles[t.value].border_first));
      },
      level.pass_over());
}

// One row under construction: sums keyed by (coarse neighbour, turn) in order of first appearance.
template <class Block>
class RowBuilder {
 public:
  using Ops = BlockOps<Block>;
  explicit RowBuilder(std::size_t local_nodes) : entry_of_(local_nodes * Ops::kTurns, kUnseen) {}

  void begin(std::uint32_t self) {
    self_ = self;
    neighbor_.clear();
    turn_.clear();
    sum_.clear();
    for (auto& d : diagonal_) {
      d = 0.0;
    }
  }
  void add(std::uint32_t j, const Coefficient<Block>& c) {
    const std::uint32_t turn = Ops::turn(c);
    std::uint32_t& entry = entry_of_[j * Ops::kTurns + turn];
    if (entry == kUnseen) {
      entry = static_cast<std::uint32_t>(sum_.size());
      neighbor_.push_back(j);
      turn_.push_back(turn);
      sum_.push_back({});
    }
    Ops::add(c, sum_[entry]);
  }
  void add_diagonal(std::size_t part, double d) { diagonal_[part] += d; }

  /// Appends the row, scaled, and returns its diagonal.
  std::array<float, Ops::kParts> finish(double scale, CoarseRows<Block>& out) {
    double turning = 0.0;
    double outside = 0.0;
    for (std::size_t k = 0; k < sum_.size(); ++k) {
      entry_of_[neighbor_[k] * Ops::kTurns + turn_[k]] = kUnseen;
      if (neighbor_[k] != self_) {
        outside += Ops::kPeriodic ? Ops::norm(sum_[k]) : sum_[k][0];
      } else if (turn_[k] == 0) {
        Ops::fold(sum_[k], diagonal_);
        continue;
      } else {
        turning += Ops::norm(sum_[k]);
      }
      for (double& s : sum_[k]) {
        s *= scale;
      }
      out.neighbor.push_back(neighbor_[k]);
      out.coefficient.push_back(Ops::from_sum(sum_[k], turn_[k]));
    }
    if (turning > 0.0) {
      auto plain = Ops::identity();
      typename Ops::Sum sum{};
      Ops::add(plain, sum);
      for (double& s : sum) {
        s *= turning * scale;
      }
      out.neighbor.push_back(self_);
      out.coefficient.push_back(Ops::from_sum(sum, 0));
    }
    out.row_begin.push_back(static_cast<std::uint32_t>(out.neighbor.size()));
    std::array<float, Ops::kParts> diagonal;
    for (std::size_t p = 0; p < Ops::kParts; ++p) {
      // Rounding must not take the form below zero: for scalars the row sums to zero by
      // definition (that keeps constants in the kernel), otherwise it can't fall below its norms.
      const double d = Ops::kPeriodic ? std::max(diagonal_[p], 0.0) : outside;
      diagonal[p] = static_cast<float>((d + turning) * scale);
    }
    return diagonal;
  }

 private:
  static constexpr std::uint32_t kUnseen = 0xffffffffU;
  std::uint32_t self_ = 0;
  std::vector<std::uint32_t> entry_of_;
  std::vector<std::uint32_t> neighbor_, turn_;
  std::vector<typename Ops::Sum> sum_;
  std::array<double, Ops::kParts> diagonal_{};
};

template <class Block>
void coarse_rows(GalerkinState<Block>& s, const SystemLevel<Block>& fine, const TileExtent& coarse,
                 std::uint32_t first, double scale) {
  using Ops = BlockOps<Block>;
  const Level& level = *fine.level;
  RowBuilder<Block> row(coarse.owned + coarse.halo);
  s.rows.term.reserve(coarse.owned);
  s.rows.row_begin.reserve(coarse.owned + 1);
  std::vector<Coefficient<Block>> gauge;
  for (std::size_t k = 0; k < s.fine.size(); ++k) {
    const TileSystem<Block>& f = s.fine[k];
    const std::uint32_t owned = f.extent.owned;
    if constexpr (Ops::kPeriodic) {
      gauge.clear();
      for (std::uint32_t i = 0; i < owned; ++i) {
        gauge.push_back(f.gauge(i));
      }
      for (const std::uint32_t slot : f.halo_slots) {
        gauge.push_back(fine.border_gauge[slot]);
      }
    }
    const std::uint32_t base = level.first_parent[first + k];
    const std::uint32_t count = level.parents[first + k];
    const MemberLists lists = list_members(f.parent.span().first(owned), base, count);
    for (std::uint32_t a = 0; a < count; ++a) {
      CoarseTerm<Block> term{zero_value<Block>(), {}, 0.0F, 0.0F};
      row.begin(base + a);
      for (const std::uint32_t i : lists[a]) {
        // An odd turn exchanges the parts.
        const std::size_t swapped = Ops::kPeriodic ? Ops::turn(gauge[i]) & 1U : 0U;
        for (std::size_t p = 0; p < Ops::kParts; ++p) {
          row.add_diagonal(p ^ swapped, f.stiffness(i, p));
        }
        term.fit += f.fit_of(i);
        term.count += f.count(i);
        if constexpr (Ops::kPeriodic) {
          const Coefficient<Block> back = Ops::adjoint(gauge[i]);
          add_scaled<Block>(term.rhs, 1.0F, apply<Block>(back, f.rhs_of(i)));
          for (std::uint32_t e = f.row_begin[i]; e < f.row_begin[i + 1]; ++e) {
            const std::uint32_t j = f.neighbor[e];
            row.add(f.parent[j], Ops::compose(Ops::compose(back, f.coefficient[e]), gauge[j]));
          }
        } else {
          add_scaled<Block>(term.rhs, 1.0F, f.rhs_of(i));
          for (std::uint32_t e = f.row_begin[i]; e < f.row_begin[i + 1]; ++e) {
            row.add(f.parent[f.neighbor[e]], f.coefficient[e]);
          }
        }
      }
      term.stiffness = row.finish(scale, s.rows);
      s.rows.term.push_back(term);
    }
  }
}

template <class Block>
void galerkin(SystemLevel<Block>& fine, SystemLevel<Block>& coarse, double scale,
              TaskGraph& tasks) {
  const Level& level = *fine.level;
  run_pass<GalerkinState<Block>>(
      tasks, "coarsening", coarse.level->layout.tile_count(),
      [&](TileId c, GalerkinState<Block>& s) {
        for (std::uint32_t t = level.group[c.value]; t < level.group[c.value + 1]; ++t) {
          s.fine.emplace_back().load(fine, TileId(t));
          s.fine.back().load_links(fine, TileId(t));
        }
      },
      [&](TileId c, GalerkinState<Block>& s) {
        coarse_rows(s, fine, coarse.level->layout.tiles[c.value], level.group[c.value], scale);
      },
      [&](TileId c, GalerkinState<Block>& s) {
        write(*coarse.store, coarse.row_begin, c, s.rows.row_begin);
        write(*coarse.store, coarse.neighbor, c, s.rows.neighbor);
        write(*coarse.store, coarse.coefficient, c, s.rows.coefficient);
        write(*coarse.store, coarse.term, c, s.rows.term);
      },
      level.pass_over());
}

template <class Block>
void set_finest(SystemLevel<Block>& l, Store& store, const SystemFields<Block>& system) {
  l.finest = &system;
  l.store = &store;
  l.row_begin = system.row_begin;
  l.neighbor = system.neighbor;
  l.coefficient = system.coefficient;
  l.solution = system.solution;
}

}  // namespace

template <class Block>
SystemHierarchy<Block>::~SystemHierarchy() {
  for (SystemLevel<Block>& l : levels) {
    if (l.store == &memory || l.store == nullptr) {
      continue;
    }
    try {
      if (l.finest == nullptr) {
        for (const std::string_view name : {l.row_begin.name, l.neighbor.name, l.coefficient.name,
                                            l.term.name, l.solution.name}) {
          l.store->erase(name);
        }
      }
      for (const std::string_view name :
           {l.residual.name, l.correction.name, l.base.name, l.product.name}) {
        l.store->erase(name);
      }
    } catch (const Error&) {
      // Scratch that cannot be erased costs disk space, nothing else.
    }
  }
}

template <class Block>
void coarsen_system(SystemHierarchy<Block>& out, Store& store, const SystemFields<Block>& system,
                    const Hierarchy& hierarchy, float coarse_stiffness, TaskGraph& tasks,
                    HaloBoard<Coefficient<Block>> border_gauges) {
  out.hierarchy = &hierarchy;
  out.levels.resize(hierarchy.levels.size());
  for (std::size_t k = 0; k < out.levels.size(); ++k) {
    SystemLevel<Block>& l = out.levels[k];
    const auto name = [&](const char* what) -> std::string_view {
      return out.names.emplace_back("solve/system" + std::to_string(k) + "_" + what);
    };
    l.level = &hierarchy.levels[k];
    l.residual = {name("residual")};
    l.correction = {name("correction")};
    l.base = {name("base")};
    l.product = {name("product")};
    if (k == 0) {
      set_finest(l, store, system);
    } else {
      l.store = l.level->layout.node_count <= kMemoryLevelNodes ? &out.memory : &store;
      l.row_begin = {name("row_begin")};
      l.neighbor = {name("neighbor")};
      l.coefficient = {name("coefficient")};
      l.term = {name("term")};
      l.solution = {name("solution")};
    }
  }
  const SystemLevel<Block>& finest = out.levels.front();
  const bool known = border_gauges.size() == finest.level->layout.border_count;
  if (known) {
    out.levels.front().border_gauge = std::move(border_gauges);
  }
  for (std::size_t k = 0; k + 1 < out.levels.size(); ++k) {
    const std::uint64_t before = tasks.passes();
    if constexpr (BlockOps<Block>::kPeriodic) {
      if (k > 0 || !known) {
        publish_gauges(out.levels[k], tasks);
      }
    }
    galerkin(out.levels[k], out.levels[k + 1], coarse_stiffness, tasks);
    out.finest_passes += tasks.passes() - before;
  }
}

template <class Block>
void leave_coarse_answer(const SystemHierarchy<Block>& system, Store& store) {
  const SystemLevel<Block>& s = system.levels[1];
  for (std::uint32_t t = 0; t < s.level->layout.tile_count(); ++t) {
    store.write_chunk(kCoarseSolution<Block>.name, TileId(t),
                      s.store->read_chunk(s.solution.name, TileId(t)));
  }
  write(store, kCoarseGauges<Block>, kBoardTile, system.levels[0].border_gauge);
}

template <class Block>
void take_coarse_answer(SystemHierarchy<Block>& out, Store& store,
                        const SystemFields<Block>& system, const Hierarchy& hierarchy) {
  out.hierarchy = &hierarchy;
  out.levels.resize(2);
  SystemLevel<Block>& finest = out.levels[0];
  finest.level = &hierarchy.levels[0];
  set_finest(finest, store, system);
  const auto gauges = read(store, kCoarseGauges<Block>, kBoardTile);
  finest.border_gauge.assign(gauges.begin(), gauges.end());
  store.erase(kCoarseGauges<Block>.name);
  SystemLevel<Block>& coarse = out.levels[1];
  coarse.level = &hierarchy.levels[1];
  coarse.store = &store;
  coarse.solution = kCoarseSolution<Block>;
}

template <class Block>
HaloBoard<Value<Block>> prolong_border(const SystemLevel<Block>& fine,
                                       const SystemLevel<Block>& coarse,
                                       Field<Value<Block>> coarse_values) {
  const Level& level = *fine.level;
  HaloBoard<Value<Block>> board(level.layout.border_count);
  for (std::uint32_t c = 0; c + 1 < level.group.size(); ++c) {
    const auto values = read(*coarse.store, coarse_values, TileId(c));
    for (std::uint32_t t = level.group[c]; t < level.group[c + 1]; ++t) {
      const auto parents = read(*level.store, level.border_parent, TileId(t));
      const std::uint64_t first = level.layout.tiles[t].border_first;
      for (std::size_t k = 0; k < parents.size(); ++k) {
        if constexpr (BlockOps<Block>::kPeriodic) {
          board[first + k] = apply<Block>(fine.border_gauge[first + k], values[parents[k]]);
        } else {
          board[first + k] = values[parents[k]];
        }
      }
    }
  }
  return board;
}

#define RATTAN_INSTANTIATE(Block)                                                               \
  template struct SystemHierarchy<Block>;                                                       \
  template void coarsen_system(SystemHierarchy<Block>&, Store&, const SystemFields<Block>&,     \
                               const Hierarchy&, float, TaskGraph&,                             \
                               HaloBoard<Coefficient<Block>>);                                  \
  template void leave_coarse_answer(const SystemHierarchy<Block>&, Store&);                     \
  template void take_coarse_answer(SystemHierarchy<Block>&, Store&, const SystemFields<Block>&, \
                                   const Hierarchy&);                                           \
  template HaloBoard<Value<Block>> prolong_border(const SystemLevel<Block>&,                    \
                                                  const SystemLevel<Block>&, Field<Value<Block>>);
RATTAN_FOR_EACH_BLOCK(RATTAN_INSTANTIATE)
#undef RATTAN_INSTANTIATE

}  // namespace rattan
