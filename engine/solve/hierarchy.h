// SPDX-License-Identifier: MIT
#pragma once

// Levels of aggregates. Every level is a TileLayout with its own halo, exactly like the scan:
// coarse nodes are numbered by their lowest member, so they stay in curve order, and a coarse tile
// unites the aggregates of consecutive finer tiles.

#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "engine/core/memory_store.h"
#include "engine/solve/solver.h"

namespace rattan {

struct Level {
  TileLayout layout;
  Store* store = nullptr;  ///< where this level's fields are; not owned
  HaloFields halo;
  Field<std::uint32_t> row_begin;  ///< graph rows, as in GraphFields
  Field<std::uint32_t> neighbor;
  Field<float> weight;
  Field<float> count;  ///< vertices of the scan in each node; no field at level 0 (all 1)

  // Links to the next coarser level; empty on the coarsest.
  Field<std::uint32_t> parent;  ///< owned + halo: node of the coarse tile (its local number)
  Field<std::uint32_t> tree;    ///< owned: neighbour one step nearer the root; self at a root
  Field<std::uint32_t> border_parent;       ///< border: parent, to prolong the board by itself
  std::vector<std::uint32_t> group;         ///< coarse tile c unites tiles [group[c], group[c + 1])
  std::vector<std::uint32_t> coarse_tile;   ///< of each tile
  std::vector<std::uint32_t> first_parent;  ///< coarse local number of each tile's first aggregate
  std::vector<std::uint32_t> parents;       ///< aggregates of each tile

  bool coarsest() const { return group.empty(); }
  PassOver pass_over() const { return count.name.empty() ? PassOver::kScan : PassOver::kCoarse; }
};

class Hierarchy {
 public:
  std::vector<Level> levels;
  MemoryStore memory;  ///< holds the levels small enough for it
  std::string_view name(std::size_t level, std::string_view what);
  /// A copy of the name that lives as long as the hierarchy.
  std::string_view keep_name(std::string name) { return names_.emplace_back(std::move(name)); }

 private:
  std::deque<std::string> names_;
};

/// Levels up to this many nodes are kept in memory (some 10 MB), larger ones go through the store,
/// whose cache is part of the memory budget.
inline constexpr std::uint64_t kMemoryLevelNodes = 1U << 15;
/// Finer tiles are united while a coarse tile stays within this many nodes.
inline constexpr std::uint32_t kCoarseTileNodes = 1U << 12;

/// Two rounds of pairwise matching inside one tile. `aggregate` numbers the aggregates by their
/// lowest member; `tree` is the spanning tree of strongest edges, as in Level.
struct Matching {
  std::vector<std::uint32_t> aggregate;
  std::vector<std::uint32_t> tree;
  std::uint32_t count = 0;
};
Matching match_twice(std::span<const std::uint32_t> row_begin,
                     std::span<const std::uint32_t> neighbor, std::span<const float> weight);

/// The aggregates of the finest level's tiles, found by a pass that makes the weights.
class FirstMatching {
 public:
  FirstMatching(Store& store, const TileLayout& layout, const HaloFields& halo);
  /// In the order of the tiles.
  void commit(TileId tile, const Matching& matching);
  /// Leaves all in the store, for load() of another one of the same layout.
  void save();
  void load();

 private:
  friend class HierarchyBuilder;
  Store& store_;
  const TileLayout& layout_;
  HaloFields halo_;
  std::vector<std::uint32_t> counts_;    ///< aggregates of each tile
  HaloBoard<std::uint64_t> aggregates_;  ///< of border nodes, numbered in their tile
};

/// Members of each aggregate of one tile, ascending: aggregate a (numbered from `first`) has
/// members[begin[a]] .. members[begin[a + 1]).
struct MemberLists {
  std::vector<std::uint32_t> begin;
  std::vector<std::uint32_t> members;
  std::span<const std::uint32_t> operator[](std::uint32_t a) const {
    return std::span(members).subspan(begin[a], begin[a + 1] - begin[a]);
  }
};
MemberLists list_members(std::span<const std::uint32_t> parent_of_owned, std::uint32_t first,
                         std::uint32_t count);

}  // namespace rattan
