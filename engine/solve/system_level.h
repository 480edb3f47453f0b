// SPDX-License-Identifier: MIT
#pragma once

// One system on one level: the finest as the caller's fields, coarser ones as Galerkin products.
// Both are used through TileSystem, the pinned chunks of one tile.

#include <span>
#include <vector>

#include "engine/solve/block_ops.h"
#include "engine/solve/border_gauges.h"
#include "engine/solve/hierarchy.h"

namespace rattan {

/// What a coarse node keeps besides its row.
template <class Block>
struct CoarseTerm {
  Value<Block> rhs;
  std::array<float, BlockOps<Block>::kParts> stiffness;  ///< diagonal without fit
  float fit;
  float count;  ///< vertices of the scan held
};

/// What a sweep needs of a node besides its row.
template <class Block>
struct NodeTerm {
  Value<Block> rhs;
  std::array<float, BlockOps<Block>::kParts> diagonal;  ///< with fit
  float eps;
};

template <class Block>
struct SystemLevel {
  const Level* level = nullptr;
  const SystemFields<Block>* finest = nullptr;  ///< level 0 only
  Store* store = nullptr;                       ///< of the system's fields on this level
  Field<std::uint32_t> row_begin;
  Field<std::uint32_t> neighbor;
  Field<Coefficient<Block>> coefficient;
  Field<CoarseTerm<Block>> term;  ///< coarse levels
  Field<Value<Block>> solution;
  HaloBoard<Value<Block>> board;               ///< border values of `solution`
  HaloBoard<Coefficient<Block>> border_gauge;  ///< from the parent's gauge to the border node's
  // Linear cycles: right-hand side (a restricted residual) and answer.
  Field<Value<Block>> residual;
  Field<Value<Block>> correction;
  HaloBoard<Value<Block>> correction_board;
  // Cycles: where the last step started from, and the restricted product of the matrix with it.
  Field<Value<Block>> base;
  HaloBoard<Value<Block>> base_board;
  Field<Value<Block>> product;
};

/// A system on all levels of a hierarchy; coarse fields die with it.
template <class Block>
struct SystemHierarchy {
  const Hierarchy* hierarchy = nullptr;
  std::vector<SystemLevel<Block>> levels;
  MemoryStore memory;
  std::deque<std::string> names;
  std::uint64_t finest_passes = 0;  ///< visits of all finest tiles that its construction made
  ~SystemHierarchy();
};

/// Gauges and Galerkin products of all levels; `coarse_stiffness` as in SolveOptions. The border
/// gauges of the finest level may be known already.
template <class Block>
void coarsen_system(SystemHierarchy<Block>& out, Store& store, const SystemFields<Block>& system,
                    const Hierarchy& hierarchy, float coarse_stiffness, TaskGraph& tasks,
                    HaloBoard<Coefficient<Block>> border_gauges = {});

/// Leaves what the finest level starts from in the store: the next level's solution, and the border
/// gauges that carry it over.
template <class Block>
void leave_coarse_answer(const SystemHierarchy<Block>& system, Store& store);
/// The finest level, above one of which only the solution is there.
template <class Block>
void take_coarse_answer(SystemHierarchy<Block>& out, Store& store,
                        const SystemFields<Block>& system, const Hierarchy& hierarchy);

/// Pinned chunks of one tile.
template <class Block>
struct TileSystem {
  TileExtent extent;
  ChunkView<std::uint32_t> row_begin;
  ChunkView<std::uint32_t> neighbor;
  ChunkView<Coefficient<Block>> coefficient;
  ChunkView<float> diagonal, fit;
  ChunkView<std::array<float, 2>> part_diagonal;
  ChunkView<Value<Block>> rhs;
  ChunkView<CoarseTerm<Block>> term;
  ChunkView<std::uint32_t> halo_slots, border;
  ChunkView<std::uint32_t> parent, tree;  ///< load_links

  float stiffness(std::uint32_t i, std::size_t part) const {
    if (term.size() != 0) {
      return term[i].stiffness[part];
    }
    return part_diagonal.size() != 0 ? diagonal[i] + part_diagonal[i][part] : diagonal[i];
  }
  float fit_of(std::uint32_t i) const {
    return term.size() != 0 ? term[i].fit : (fit.size() != 0 ? fit[i] : 0.0F);
  }
  /// What the fit and the part's own diagonal pull to costs |b|^2 / weight by itself: with it the
  /// energy of a target met is zero. Finest level only.
  double target_energy(std::uint32_t i) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < BlockOps<Block>::kReals && rhs.size() != 0; ++k) {
      const std::size_t part = k * BlockOps<Block>::kParts / BlockOps<Block>::kReals;
      const double weight = static_cast<double>(fit_of(i)) +
                            (part_diagonal.size() != 0 ? part_diagonal[i][part] : 0.0F);
      const double b = reals<Block>(rhs[i])[k];
      sum += weight > 0.0 ? b * b / weight : 0.0;
    }
    return sum;
  }
  float count(std::uint32_t i) const { return term.size() != 0 ? term[i].count : 1.0F; }
  Value<Block> rhs_of(std::uint32_t i) const {
    return term.size() != 0 ? term[i].rhs : (rhs.size() != 0 ? rhs[i] : zero_value<Block>());
  }

  void load(const SystemLevel<Block>& s, TileId t) {
    extent = s.level->layout.tiles[t.value];
    row_begin = read(*s.store, s.row_begin, t);
    neighbor = read(*s.store, s.neighbor, t);
    coefficient = read(*s.store, s.coefficient, t);
    if (s.finest != nullptr) {
      diagonal = read(*s.store, s.finest->diagonal, t);
      if (!s.finest->part_diagonal.name.empty()) {
        part_diagonal = read(*s.store, s.finest->part_diagonal, t);
      }
      if (!s.finest->fit.name.empty()) {
        fit = read(*s.store, s.finest->fit, t);
      }
      if (!s.finest->rhs.name.empty()) {
        rhs = read(*s.store, s.finest->rhs, t);
      }
    } else {
      term = read(*s.store, s.term, t);
    }
    load_halo(s, t);
  }
  void load_halo(const SystemLevel<Block>& s, TileId t) {
    extent = s.level->layout.tiles[t.value];
    halo_slots = read(*s.level->store, s.level->halo.halo_slots, t);
    border = read(*s.level->store, s.level->halo.border, t);
  }
  /// Needs a coarser level.
  void load_links(const SystemLevel<Block>& s, TileId t) {
    parent = read(*s.level->store, s.level->parent, t);
    tree = read(*s.level->store, s.level->tree, t);
  }

  /// Terms for sweeps: eps is `penalty` times the count.
  std::vector<NodeTerm<Block>> terms(float penalty) const {
    std::vector<NodeTerm<Block>> out(extent.owned);
    for (std::uint32_t i = 0; i < extent.owned; ++i) {
      out[i].rhs = rhs_of(i);
      for (std::size_t p = 0; p < BlockOps<Block>::kParts; ++p) {
        out[i].diagonal[p] = stiffness(i, p) + fit_of(i);
      }
      out[i].eps = penalty * count(i);
    }
    return out;
  }

  /// Carries a value from the parent's gauge to node i's, by the strongest edges along the tree.
  Coefficient<Block> gauge(std::uint32_t i) const {
    return gauge_along<Block>(tree.span(), row_begin.span(), neighbor.span(), coefficient.span(),
                              i);
  }
};

/// Owned values from the store (in local order), then the halo's from the board.
template <class T>
std::vector<T> gather_local(std::span<const T> owned, const ChunkView<std::uint32_t>& halo_slots,
                            const HaloBoard<T>& board) {
  return with_halo(owned, halo_slots.span(), board);
}

/// Border values of a level as prolonged from `coarse_values` of the next: x_i = G_i x_parent.
template <class Block>
HaloBoard<Value<Block>> prolong_border(const SystemLevel<Block>& fine,
                                       const SystemLevel<Block>& coarse,
                                       Field<Value<Block>> coarse_values);

#define RATTAN_FOR_EACH_BLOCK(MACRO) \
  MACRO(RealBlock)                   \
  MACRO(Real3Block)                  \
  MACRO(ComplexBlock)                \
  MACRO(PairBlock)

}  // namespace rattan
