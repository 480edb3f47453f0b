// SPDX-License-Identifier: MIT
#include "engine/solve/hierarchy.h"

#include <algorithm>
#include <utility>

namespace rattan {

std::string_view Hierarchy::name(std::size_t level, std::string_view what) {
  return names_.emplace_back("solve/level" + std::to_string(level) + "_" + std::string(what));
}

namespace {

constexpr Field<std::uint32_t> kFirstAggregate{"solve/level0_aggregate"};
constexpr Field<std::uint32_t> kFirstTree{"solve/level0_tree"};
constexpr Field<std::uint32_t> kFirstCounts{"solve/level0_aggregate_count"};
constexpr Field<std::uint64_t> kFirstBoard{"solve/level0_aggregate_board"};

// Aggregates of a level's tiles.
struct Aggregates {
  HaloBoard<std::uint64_t> board;     // of border nodes, by numbers of the tile
  std::vector<std::uint32_t> counts;  // of each tile
};

// Leaves `aggregate` (tile-local numbers) and `tree` in the store, and notes the rest.
void commit_matching(Store& store, const TileLayout& layout, const HaloFields& halo,
                     Field<std::uint32_t> aggregate, Field<std::uint32_t> tree, TileId t,
                     const Matching& matching, HaloBoard<std::uint64_t>& board,
                     std::vector<std::uint32_t>& counts) {
  write(store, aggregate, t, matching.aggregate);
  write(store, tree, t, matching.tree);
  counts[t.value] = matching.count;
  const TileExtent& extent = layout.tiles[t.value];
  const auto border = read(store, halo.border, t);
  for (std::size_t k = 0; k < border.size(); ++k) {
    board[extent.border_first + k] = matching.aggregate[border[k]];
  }
}

// One pass: aggregates of each tile.
Aggregates aggregate_level(const Level& level, Field<std::uint32_t> aggregate, TaskGraph& tasks) {
  struct State {
    ChunkView<std::uint32_t> row_begin, neighbor;
    ChunkView<float> weight;
    Matching matching;
  };
  Store& store = *level.store;
  Aggregates made;
  made.board.resize(level.layout.border_count);
  made.counts.assign(level.layout.tile_count(), 0);
  run_pass<State>(
      tasks, "aggregation", level.layout.tile_count(),
      [&](TileId t, State& s) {
        s.row_begin = read(store, level.row_begin, t);
        s.neighbor = read(store, level.neighbor, t);
        s.weight = read(store, level.weight, t);
      },
      [&](TileId, State& s) {
        s.matching = match_twice(s.row_begin.span(), s.neighbor.span(), s.weight.span());
      },
      [&](TileId t, State& s) {
        commit_matching(store, level.layout, level.halo, aggregate, level.tree, t, s.matching,
                        made.board, made.counts);
      },
      level.pass_over());
  return made;
}

// Which tiles are united, and where their aggregates land.
TileLayout unite_tiles(Level& level) {
  TileLayout coarse;
  level.group.clear();
  level.coarse_tile.clear();
  level.first_parent.clear();
  for (std::uint32_t t = 0; t < level.layout.tile_count(); ++t) {
    const std::uint32_t n = level.parents[t];
    if (coarse.tiles.empty() || coarse.tiles.back().owned + n > kCoarseTileNodes) {
      TileExtent e;
      e.first = coarse.node_count;
      coarse.tiles.push_back(e);
      level.group.push_back(t);
    }
    level.coarse_tile.push_back(coarse.tile_count() - 1);
    level.first_parent.push_back(coarse.tiles.back().owned);
    coarse.tiles.back().owned += n;
    coarse.node_count += n;
  }
  level.group.push_back(level.layout.tile_count());
  return coarse;
}

struct FineTile {
  ChunkView<std::uint32_t> row_begin, neighbor, border, halo_slots, aggregate;
  ChunkView<float> weight, count;
  std::vector<std::uint32_t> parent;
  std::vector<std::uint32_t> border_parent;
};

struct UniteState {
  std::vector<FineTile> fine;
  std::vector<std::uint64_t> halo_ids;
  std::vector<std::uint32_t> row_begin{0};
  std::vector<std::uint32_t> neighbor;
  std::vector<float> weight;
  std::vector<float> count;
};

// Parents of owned and halo nodes as local numbers of the coarse tile, whose halo this defines.
void number_parents(UniteState& s, const Level& level, const TileExtent& coarse,
                    std::uint32_t first, const HaloBoard<std::uint64_t>& board) {
  for (const FineTile& f : s.fine) {
    for (const std::uint32_t slot : f.halo_slots) {
      const std::uint64_t id = board[slot];
      if (id < coarse.first || id >= coarse.first + coarse.owned) {
        s.halo_ids.push_back(id);
      }
    }
  }
  std::sort(s.halo_ids.begin(), s.halo_ids.end());
  s.halo_ids.erase(std::unique(s.halo_ids.begin(), s.halo_ids.end()), s.halo_ids.end());
  for (std::size_t k = 0; k < s.fine.size(); ++k) {
    FineTile& f = s.fine[k];
    f.parent.reserve(f.aggregate.size() + f.halo_slots.size());
    for (const std::uint32_t a : f.aggregate) {
      f.parent.push_back(level.first_parent[first + k] + a);
    }
    for (const std::uint32_t slot : f.halo_slots) {
      const std::uint64_t id = board[slot];
      if (id >= coarse.first && id < coarse.first + coarse.owned) {
        f.parent.push_back(static_cast<std::uint32_t>(id - coarse.first));
      } else {
        const auto at = std::lower_bound(s.halo_ids.begin(), s.halo_ids.end(), id);
        f.parent.push_back(coarse.owned + static_cast<std::uint32_t>(at - s.halo_ids.begin()));
      }
    }
    for (const std::uint32_t b : f.border) {
      f.border_parent.push_back(f.parent[b]);
    }
  }
}

// Rows of the coarse graph: weights between aggregates summed, edges within dropped.
void sum_rows(UniteState& s, const Level& level, const TileExtent& coarse, std::uint32_t first) {
  constexpr std::uint32_t kUnseen = 0xffffffffU;
  std::vector<std::uint32_t> entry_of(coarse.owned + s.halo_ids.size(), kUnseen);
  s.count.reserve(coarse.owned);
  s.row_begin.reserve(coarse.owned + 1);
  for (std::size_t k = 0; k < s.fine.size(); ++k) {
    const FineTile& f = s.fine[k];
    const std::uint32_t base = level.first_parent[first + k];
    const std::span<const std::uint32_t> owned(f.parent.data(), f.aggregate.size());
    const MemberLists lists = list_members(owned, base, level.parents[first + k]);
    for (std::uint32_t a = 0; a < level.parents[first + k]; ++a) {
      float held = 0.0F;
      const auto row = static_cast<std::uint32_t>(s.neighbor.size());
      for (const std::uint32_t i : lists[a]) {
        held += f.count.size() == 0 ? 1.0F : f.count[i];
        for (std::uint32_t e = f.row_begin[i]; e < f.row_begin[i + 1]; ++e) {
          const std::uint32_t j = f.parent[f.neighbor[e]];
          if (j == base + a) {
            continue;
          }
          // An entry of an earlier row is stale: this row starts at `row`.
          if (entry_of[j] == kUnseen || entry_of[j] < row) {
            entry_of[j] = static_cast<std::uint32_t>(s.neighbor.size());
            s.neighbor.push_back(j);
            s.weight.push_back(0.0F);
          }
          s.weight[entry_of[j]] += f.weight[e];
        }
      }
      s.count.push_back(held);
      s.row_begin.push_back(static_cast<std::uint32_t>(s.neighbor.size()));
    }
  }
}

Level unite_level(Hierarchy& hierarchy, Level& level, std::size_t number, Store& scan_store,
                  Field<std::uint32_t> aggregate, HaloBoard<std::uint64_t>& board,
                  TaskGraph& tasks) {
  Level coarse;
  coarse.layout = unite_tiles(level);
  coarse.store = coarse.layout.node_count <= kMemoryLevelNodes ? &hierarchy.memory : &scan_store;
  coarse.halo = {{hierarchy.name(number, "halo_ids")},
                 {hierarchy.name(number, "halo_slots")},
                 {hierarchy.name(number, "border")}};
  coarse.row_begin = {hierarchy.name(number, "row_begin")};
  coarse.neighbor = {hierarchy.name(number, "neighbor")};
  coarse.weight = {hierarchy.name(number, "weight")};
  coarse.count = {hierarchy.name(number, "count")};

  // From tile-local numbers of aggregates to numbers of the level.
  for (std::uint32_t t = 0; t < level.layout.tile_count(); ++t) {
    const TileExtent& e = level.layout.tiles[t];
    const std::uint64_t shift =
        coarse.layout.tiles[level.coarse_tile[t]].first + level.first_parent[t];
    for (std::uint32_t k = 0; k < e.border; ++k) {
      board[e.border_first + k] += shift;
    }
  }

  Store& store = *level.store;
  std::vector<std::vector<std::uint64_t>> halo_ids(coarse.layout.tile_count());
  run_pass<UniteState>(
      tasks, "aggregation", coarse.layout.tile_count(),
      [&](TileId c, UniteState& s) {
        for (std::uint32_t t = level.group[c.value]; t < level.group[c.value + 1]; ++t) {
          FineTile& f = s.fine.emplace_back();
          f.row_begin = read(store, level.row_begin, TileId(t));
          f.neighbor = read(store, level.neighbor, TileId(t));
          f.weight = read(store, level.weight, TileId(t));
          f.border = read(store, level.halo.border, TileId(t));
          f.halo_slots = read(store, level.halo.halo_slots, TileId(t));
          f.aggregate = read(store, aggregate, TileId(t));
          if (!level.count.name.empty()) {
            f.count = read(store, level.count, TileId(t));
          }
        }
      },
      [&](TileId c, UniteState& s) {
        const TileExtent& extent = coarse.layout.tiles[c.value];
        number_parents(s, level, extent, level.group[c.value], board);
        sum_rows(s, level, extent, level.group[c.value]);
      },
      [&](TileId c, UniteState& s) {
        for (std::size_t k = 0; k < s.fine.size(); ++k) {
          const TileId t(level.group[c.value] + static_cast<std::uint32_t>(k));
          write(store, level.parent, t, s.fine[k].parent);
          write(store, level.border_parent, t, s.fine[k].border_parent);
        }
        write(*coarse.store, coarse.row_begin, c, s.row_begin);
        write(*coarse.store, coarse.neighbor, c, s.neighbor);
        write(*coarse.store, coarse.weight, c, s.weight);
        write(*coarse.store, coarse.count, c, s.count);
        halo_ids[c.value] = std::move(s.halo_ids);
      },
      level.pass_over());
  store.erase(aggregate.name);

  std::vector<std::vector<std::uint32_t>> border;
  std::vector<std::vector<std::uint32_t>> slots;
  connect_halos(coarse.layout, halo_ids, border, slots);
  for (std::uint32_t c = 0; c < coarse.layout.tile_count(); ++c) {
    write(*coarse.store, coarse.halo.halo_ids, TileId(c), halo_ids[c]);
    write(*coarse.store, coarse.halo.halo_slots, TileId(c), slots[c]);
    write(*coarse.store, coarse.halo.border, TileId(c), border[c]);
  }
  return coarse;
}

}  // namespace

FirstMatching::FirstMatching(Store& store, const TileLayout& layout, const HaloFields& halo)
    : store_(store),
      layout_(layout),
      halo_(halo),
      counts_(layout.tile_count(), 0),
      aggregates_(layout.border_count) {}

void FirstMatching::commit(TileId tile, const Matching& matching) {
  commit_matching(store_, layout_, halo_, kFirstAggregate, kFirstTree, tile, matching, aggregates_,
                  counts_);
}

void FirstMatching::save() {
  write(store_, kFirstCounts, kBoardTile, counts_);
  write(store_, kFirstBoard, kBoardTile, aggregates_);
}

void FirstMatching::load() {
  const auto counts = read(store_, kFirstCounts, kBoardTile);
  const auto board = read(store_, kFirstBoard, kBoardTile);
  counts_.assign(counts.begin(), counts.end());
  aggregates_.assign(board.begin(), board.end());
  store_.erase(kFirstCounts.name);
  store_.erase(kFirstBoard.name);
}

class HierarchyBuilder {
 public:
  static Aggregates take(FirstMatching& matching) {
    return {std::move(matching.aggregates_), std::move(matching.counts_)};
  }
};

MemberLists list_members(std::span<const std::uint32_t> parent_of_owned, std::uint32_t first,
                         std::uint32_t count) {
  MemberLists lists;
  lists.begin.assign(count + 1, 0);
  for (const std::uint32_t p : parent_of_owned) {
    ++lists.begin[p - first + 1];
  }
  for (std::uint32_t a = 0; a < count; ++a) {
    lists.begin[a + 1] += lists.begin[a];
  }
  lists.members.resize(parent_of_owned.size());
  std::vector<std::uint32_t> next(lists.begin.begin(), lists.begin.end() - 1);
  for (std::uint32_t i = 0; i < parent_of_owned.size(); ++i) {
    lists.members[next[parent_of_owned[i] - first]++] = i;
  }
  return lists;
}

namespace {

// A coarse level's own graph has served once the next level is there: systems bring their rows.
void erase_graph(const Level& level) {
  for (const std::string_view name :
       {level.row_begin.name, level.neighbor.name, level.weight.name}) {
    level.store->erase(name);
  }
}

}  // namespace

std::shared_ptr<const Hierarchy> build_hierarchy(Store& store, const TileLayout& layout,
                                                 const HaloFields& halo, const GraphFields& graph,
                                                 const HierarchyOptions& options, TaskGraph& tasks,
                                                 FirstMatching* matching) {
  auto hierarchy = std::make_shared<Hierarchy>();
  Level finest;
  finest.layout = layout;
  finest.store = &store;
  finest.halo = halo;
  finest.row_begin = graph.row_begin;
  finest.neighbor = graph.neighbor;
  finest.weight = graph.weight;
  hierarchy->levels.push_back(std::move(finest));

  while (true) {
    const std::size_t k = hierarchy->levels.size() - 1;
    Level& level = hierarchy->levels[k];
    if (level.layout.node_count <= options.coarsest_nodes && level.layout.tile_count() <= 1) {
      break;
    }
    level.parent = {hierarchy->name(k, "parent")};
    level.tree = k == 0 ? kFirstTree : Field<std::uint32_t>{hierarchy->name(k, "tree")};
    level.border_parent = {hierarchy->name(k, "border_parent")};
    const Field<std::uint32_t> aggregate =
        k == 0 ? kFirstAggregate : Field<std::uint32_t>{hierarchy->name(k, "aggregate")};
    Aggregates aggregates = k == 0 && matching != nullptr
                                ? HierarchyBuilder::take(*matching)
                                : aggregate_level(level, aggregate, tasks);
    level.parents = std::move(aggregates.counts);
    Level coarse = unite_level(*hierarchy, level, k + 1, store, aggregate, aggregates.board, tasks);
    // Many components, or edges without weight: what is left doesn't aggregate.
    const bool stalled = 10 * coarse.layout.node_count > 9 * level.layout.node_count &&
                         coarse.layout.tile_count() == level.layout.tile_count();
    hierarchy->levels.push_back(std::move(coarse));
    if (k > 0) {
      erase_graph(hierarchy->levels[k]);
    }
    if (stalled) {
      break;
    }
  }
  if (hierarchy->levels.size() > 1) {
    erase_graph(hierarchy->levels.back());
  }
  store.erase(kFirstAggregate.name);
  return hierarchy;
}

}  // namespace rattan
