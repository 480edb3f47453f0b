// SPDX-License-Identifier: MIT
#include "engine/solve/hierarchy_record.h"

#include <string>

#include "engine/core/packed_chunk.h"
#include "engine/solve/hierarchy.h"

namespace rattan {

namespace {

constexpr std::string_view kRecord = "hierarchy/levels";

/// f(name) for each field's name of a level, in one order.
template <class F>
void for_each_name(Level& l, const F& f) {
  for (std::string_view* name :
       {&l.halo.halo_ids.name, &l.halo.halo_slots.name, &l.halo.border.name, &l.row_begin.name,
        &l.neighbor.name, &l.weight.name, &l.count.name, &l.parent.name, &l.tree.name,
        &l.border_parent.name}) {
    f(*name);
  }
}

struct LevelRecord {
  TileLayout layout;
  bool in_memory = false;
  std::vector<std::string> names;
  std::vector<std::uint32_t> group, coarse_tile, first_parent, parents;
};

template <class A>
void members_of(A& a, LevelRecord& r) {
  a(r.layout.tiles);
  a(r.layout.node_count);
  a(r.layout.border_count);
  a(r.in_memory);
  a(r.names);
  a(r.group);
  a(r.coarse_tile);
  a(r.first_parent);
  a(r.parents);
}

/// The chunks of a level in memory, from one store to the other. They are shared, not copied.
void copy_chunks(Store& from, Store& to, const LevelRecord& level) {
  for (const std::string& name : level.names) {
    if (name.empty()) {
      continue;
    }
    for (std::uint32_t t = 0; t < level.layout.tile_count(); ++t) {
      if (from.has_chunk(name, TileId(t))) {
        to.write_chunk(name, TileId(t), from.read_chunk(name, TileId(t)));
      }
    }
  }
}

}  // namespace

void save_hierarchy(Store& store, const Hierarchy& hierarchy) {
  std::vector<LevelRecord> records;
  for (Level level : hierarchy.levels) {
    LevelRecord& r = records.emplace_back();
    r.layout = level.layout;
    r.in_memory = level.store == &hierarchy.memory;
    for_each_name(level, [&](std::string_view& name) { r.names.emplace_back(name); });
    r.group = level.group;
    r.coarse_tile = level.coarse_tile;
    r.first_parent = level.first_parent;
    r.parents = level.parents;
    if (r.in_memory) {
      copy_chunks(*level.store, store, r);
    }
  }
  write_packed(store, kRecord, records);
}

std::shared_ptr<const Hierarchy> load_hierarchy(Store& store) {
  std::vector<LevelRecord> records;
  read_packed(store, kRecord, records);
  auto hierarchy = std::make_shared<Hierarchy>();
  for (LevelRecord& r : records) {
    Level& level = hierarchy->levels.emplace_back();
    if (r.in_memory) {
      copy_chunks(store, hierarchy->memory, r);
    }
    level.store = r.in_memory ? static_cast<Store*>(&hierarchy->memory) : &store;
    std::size_t next = 0;
    for_each_name(level,
                  [&](std::string_view& name) { name = hierarchy->keep_name(r.names.at(next++)); });
    level.layout = std::move(r.layout);
    level.group = std::move(r.group);
    level.coarse_tile = std::move(r.coarse_tile);
    level.first_parent = std::move(r.first_parent);
    level.parents = std::move(r.parents);
  }
  return hierarchy;
}

}  // namespace rattan
