// SPDX-License-Identifier: MIT
#pragma once

// Counts the topology of a small triangle mesh by sorting, for the tests.

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

namespace rattan::testing {

struct MeshTopology {
  bool is_manifold = true;  ///< edges of one or two triangles, run opposite ways; one fan a vertex
  bool is_simple = true;    ///< no repeated corner, no triangle twice
  std::uint64_t edges = 0;
  std::uint64_t components = 0;
  std::uint64_t boundary_loops = 0;
  std::uint64_t unused_vertices = 0;
  std::int64_t euler = 0;
};

class UnionFind {
 public:
  explicit UnionFind(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0U); }
  std::size_t find(std::size_t x) {
    while (parent_[x] != x) {
      x = parent_[x] = parent_[parent_[x]];
    }
    return x;
  }
  void join(std::size_t a, std::size_t b) { parent_[find(a)] = find(b); }

 private:
  std::vector<std::size_t> parent_;
};

inline MeshTopology count_topology(std::size_t vertex_count,
                                   const std::vector<std::array<std::uint64_t, 3>>& triangles) {
  struct Edge {
    std::uint64_t low, high;
    std::size_t triangle;
    bool forward;
    auto operator<=>(const Edge&) const = default;
  };
  MeshTopology topology;
  std::vector<Edge> edges;
  std::vector<std::array<std::uint64_t, 3>> sorted = triangles;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    std::sort(sorted[t].begin(), sorted[t].end());
    topology.is_simple &= sorted[t][0] != sorted[t][1] && sorted[t][1] != sorted[t][2];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t a = triangles[t][k];
      const std::uint64_t b = triangles[t][(k + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), t, a < b});
    }
  }
  std::sort(sorted.begin(), sorted.end());
  topology.is_simple &= std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end();
  std::sort(edges.begin(), edges.end());

  // Corner 3 t + k joins the corner of the neighbour across an edge at the same vertex: fans.
  const auto corner = [&](std::size_t t, std::uint64_t v) {
    return 3 * t + (triangles[t][0] == v ? 0U : (triangles[t][1] == v ? 1U : 2U));
  };
  UnionFind fans(3 * triangles.size());
  UnionFind components(triangles.size());
  UnionFind loops(vertex_count);
  std::vector<std::uint8_t> on_boundary(vertex_count, 0);
  for (std::size_t first = 0, end = 0; first < edges.size(); first = end) {
    for (end = first; end < edges.size() && edges[end].low == edges[first].low &&
                      edges[end].high == edges[first].high;) {
      ++end;
    }
    ++topology.edges;
    if (end - first == 1) {
      loops.join(edges[first].low, edges[first].high);
      on_boundary[edges[first].low] = on_boundary[edges[first].high] = 1;
    } else if (end - first > 2 || edges[first].forward == edges[first + 1].forward) {
      topology.is_manifold = false;
    } else {
      const Edge& a = edges[first];
      const Edge& b = edges[first + 1];
      components.join(a.triangle, b.triangle);
      fans.join(corner(a.triangle, a.low), corner(b.triangle, a.low));
      fans.join(corner(a.triangle, a.high), corner(b.triangle, a.high));
    }
  }
  std::vector<std::uint64_t> fans_at(vertex_count, 0);
  for (std::size_t c = 0; c < 3 * triangles.size(); ++c) {
    if (fans.find(c) == c) {
      ++fans_at[triangles[c / 3][c % 3]];
    }
  }
  std::uint64_t used = 0;
  for (std::size_t v = 0; v < vertex_count; ++v) {
    topology.is_manifold &= fans_at[v] <= 1;
    used += static_cast<std::uint64_t>(fans_at[v] > 0);
    topology.boundary_loops +=
        static_cast<std::uint64_t>(on_boundary[v] != 0 && loops.find(v) == v);
  }
  topology.unused_vertices = vertex_count - used;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    topology.components += static_cast<std::uint64_t>(components.find(t) == t);
  }
  topology.euler = static_cast<std::int64_t>(used) - static_cast<std::int64_t>(topology.edges) +
                   static_cast<std::int64_t>(triangles.size());
  return topology;
}

}  // namespace rattan::testing
