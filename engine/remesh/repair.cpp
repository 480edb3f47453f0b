// SPDX-License-Identifier: MIT
#include "engine/remesh/repair.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

namespace rattan {
namespace {

using VertexSet = std::array<std::uint32_t, 4>;

VertexSet vertex_set(const CellMap& map, std::uint32_t f) {
  VertexSet set;
  set.fill(CellMap::kNone);
  std::size_t k = 0;
  std::uint32_t h = map.face_half(f);
  do {
    set[k++] = map.origin(h);
    h = map.next(h);
  } while (h != map.face_half(f));
  std::sort(set.begin(), set.end());
  return set;
}

/// Whether a face other than f and g has exactly these vertices.
bool occupied(const CellMap& map, const VertexSet& set, std::uint32_t f, std::uint32_t g) {
  const std::uint32_t start = map.vertex_half(set[0]);
  std::uint32_t h = start;
  do {
    const std::uint32_t k = map.face(h);
    if (k != f && k != g && !map.is_hole(k) && map.degree(k) <= 4 && vertex_set(map, k) == set) {
      return true;
    }
    h = map.around(h);
  } while (h != start);
  return false;
}

/// v is interior and of valence two: its two faces become one.
bool remove_doublet(CellMap& map, std::uint32_t v) {
  if (map.is_corner(v) || map.on_feature(v)) {
    return false;
  }
  const std::uint32_t h = map.vertex_half(v), k = map.around(h);
  const std::uint32_t f = map.face(h), g = map.face(k);
  const std::uint32_t u = map.target(h), w = map.target(k);
  for (const std::uint32_t end : {u, w}) {
    if (!map.on_boundary(end) && map.valence(end) < 3) {
      return false;
    }
  }
  if (map.degree(f) + map.degree(g) < 7) {
    return false;
  }
  std::array<std::uint32_t, 4> merged;
  merged.fill(CellMap::kNone);
  std::size_t count = 0;
  for (const std::uint32_t face : {f, g}) {
    for (const std::uint32_t x : vertex_set(map, face)) {
      if (x != CellMap::kNone && x != v && x != u && x != w) {
        merged[count++] = x;
      }
    }
  }
  if (count == 2 && merged[0] == merged[1]) {
    return false;
  }
  merged[count++] = u;
  merged[count++] = w;
  std::sort(merged.begin(), merged.end());
  if (occupied(map, merged, f, g)) {
    return false;
  }
  map.erase_edge(h);
  map.contract_edge(CellMap::twin(k), Vec3d(map.position(w)));
  return true;
}

}  // namespace

RepairReport repair(CellMap& map) {
  RepairReport report;
  std::vector<std::uint32_t> todo;
  for (std::uint32_t v = map.vertex_count(); v-- > 0;) {
    if (map.vertex_alive(v) && map.valence(v) == 2 && !map.on_boundary(v)) {
      todo.push_back(v);
    }
  }
  while (!todo.empty()) {
    const std::uint32_t v = todo.back();
    todo.pop_back();
    if (!map.vertex_alive(v) || map.valence(v) != 2) {
      continue;
    }
    const std::uint32_t h = map.vertex_half(v);
    const std::uint32_t u = map.target(h), w = map.target(map.around(h));
    if (remove_doublet(map, v)) {
      ++report.doublets;
      for (const std::uint32_t end : {u, w}) {
        if (map.valence(end) == 2 && !map.on_boundary(end)) {
          todo.push_back(end);
        }
      }
    } else {
      const std::uint32_t f = map.face(h), g = map.face(map.around(h));
      map.inset_face(map.face_normal(g).squaredNorm() > map.face_normal(f).squaredNorm() ? g : f);
      ++report.insets;
    }
  }

  std::vector<std::pair<VertexSet, std::uint32_t>> sets;
  for (std::uint32_t f = 0; f < map.face_count(); ++f) {
    if (map.is_cell(f)) {
      sets.emplace_back(vertex_set(map, f), f);
    }
  }
  std::sort(sets.begin(), sets.end());
  for (std::size_t i = 1; i < sets.size(); ++i) {
    if (sets[i].first == sets[i - 1].first) {
      map.inset_face(sets[i].second);
      ++report.insets;
    }
  }
  report.insets += inset_undividable_quads(map);
  return report;
}

std::uint64_t inset_undividable_quads(CellMap& map) {
  struct OnlyDiagonal {
    std::uint32_t low, high, face;
    auto operator<=>(const OnlyDiagonal&) const = default;
  };
  std::vector<std::uint32_t> locked;
  std::vector<OnlyDiagonal> single;
  for (std::uint32_t f = 0; f < map.face_count(); ++f) {
    if (!map.is_cell(f) || map.degree(f) != 4) {
      continue;
    }
    const auto [a, b, c, d] = map.quad_corners(map.face_half(f));
    const bool ac = !map.adjacent(a, c), bd = !map.adjacent(b, d);
    if (!ac && !bd) {
      locked.push_back(f);
    } else if (ac != bd) {
      single.push_back(ac ? OnlyDiagonal{std::min(a, c), std::max(a, c), f}
                          : OnlyDiagonal{std::min(b, d), std::max(b, d), f});
    }
  }
  std::sort(single.begin(), single.end());
  for (std::size_t i = 1; i < single.size(); ++i) {
    if (single[i].low == single[i - 1].low && single[i].high == single[i - 1].high) {
      locked.push_back(single[i].face);
    }
  }
  for (const std::uint32_t f : locked) {
    map.inset_face(f);
  }
  return locked.size();
}

}  // namespace rattan
