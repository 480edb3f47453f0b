// SPDX-License-Identifier: MIT
#pragma once

// Scans with defects for the tests of ingest, and the checks that every ingested scan must pass.

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "engine/core/memory_store.h"
#include "engine/mesh/ingest.h"

namespace rattan::testing {

using Corner3 = std::array<std::uint64_t, 3>;

struct Soup {
  std::vector<Vec3d> positions;
  std::vector<Corner3> triangles;

  std::uint64_t add(double x, double y, double z) {
    positions.emplace_back(x, y, z);
    return positions.size() - 1;
  }
  void quad(std::uint64_t a, std::uint64_t b, std::uint64_t c, std::uint64_t d) {
    triangles.push_back({a, b, c});
    triangles.push_back({a, c, d});
  }
};

/// nu x nv cells; wrapped in a direction or open.
inline Soup grid(std::uint32_t nu, std::uint32_t nv, bool wrap_u, bool wrap_v) {
  Soup s;
  const std::uint32_t pu = wrap_u ? nu : nu + 1;
  const std::uint32_t pv = wrap_v ? nv : nv + 1;
  for (std::uint32_t u = 0; u < pu; ++u) {
    for (std::uint32_t v = 0; v < pv; ++v) {
      const double a = 2 * 3.14159265358979 * u / nu;
      const double b = 2 * 3.14159265358979 * v / nv;
      if (wrap_u && wrap_v) {
        s.add((3 + std::cos(b)) * std::cos(a), (3 + std::cos(b)) * std::sin(a), std::sin(b));
      } else if (wrap_u) {
        s.add(std::cos(a), std::sin(a), 0.1 * v);
      } else {
        s.add(u, v, 0.1 * std::sin(0.3 * u) * std::cos(0.2 * v));
      }
    }
  }
  for (std::uint32_t u = 0; u < nu; ++u) {
    for (std::uint32_t v = 0; v < nv; ++v) {
      const auto id = [&](std::uint32_t i, std::uint32_t j) {
        return std::uint64_t{i % pu} * pv + j % pv;
      };
      s.quad(id(u, v), id(u + 1, v), id(u + 1, v + 1), id(u, v + 1));
    }
  }
  return s;
}

inline Soup torus(std::uint32_t nu, std::uint32_t nv) {
  return grid(nu, nv, true, true);
}

inline Soup joined(const Soup& a, const Soup& b, const Vec3d& shift) {
  Soup s = a;
  for (const Vec3d& p : b.positions) {
    s.positions.push_back(p + shift);
  }
  for (const Corner3& t : b.triangles) {
    const std::uint64_t n = a.positions.size();
    s.triangles.push_back({t[0] + n, t[1] + n, t[2] + n});
  }
  return s;
}

inline ScanMesh ingest(Store& store, const Soup& soup, IngestOptions options = {},
                       int threads = 0) {
  Ingest in(store, std::move(options));
  // Interleaved, triangles ahead of their vertices.
  const std::size_t half = soup.triangles.size() / 2;
  in.add_triangles(std::span(soup.triangles).first(half));
  in.add_vertices(soup.positions);
  in.add_triangles(std::span(soup.triangles).subspan(half));
  TaskGraph graph({.threads = threads});
  return in.finish(graph);
}

/// The whole mesh by global ids.
struct Whole {
  std::vector<Vec3f> positions;
  std::vector<std::uint8_t> flags;
  std::vector<Corner3> triangles;
  friend bool operator==(const Whole&, const Whole&) = default;
};

/// Reads the tiles back, checking every promise of tile_mesh.h on the way.
inline Whole read_back(Store& store, const ScanMesh& mesh) {
  Whole w;
  std::vector<Corner3> all;
  std::uint64_t slots = 0;
  std::vector<std::vector<Corner3>> touching;
  for (std::uint32_t t = 0; t < mesh.layout.tile_count(); ++t) {
    const TileMesh tile = load_tile(store, mesh, TileId(t));
    EXPECT_EQ(tile.extent.first, w.positions.size());
    EXPECT_EQ(tile.positions.size(), tile.local_vertices());
    EXPECT_EQ(tile.triangles.size(), tile.counts.touching);
    EXPECT_EQ(tile.halo_ids.size(), tile.extent.halo);
    EXPECT_EQ(tile.counts.first, w.triangles.size());
    EXPECT_TRUE(std::is_sorted(tile.halo_ids.begin(), tile.halo_ids.end()));
    w.positions.insert(w.positions.end(), tile.positions.begin(),
                       tile.positions.begin() + tile.extent.owned);
    const auto flags = read(store, fields::kVertexFlag, TileId(t));
    EXPECT_EQ(flags.size(), tile.extent.owned);
    w.flags.insert(w.flags.end(), flags.begin(), flags.end());
    std::vector<Corner3> mine;
    for (const LocalTriangle& l : tile.triangles) {
      for (const std::uint32_t v : l) {
        EXPECT_LT(v, tile.local_vertices());
      }
      mine.push_back({tile.global_id(l[0]), tile.global_id(l[1]), tile.global_id(l[2])});
      EXPECT_LT(mine.back()[0], std::min(mine.back()[1], mine.back()[2]));
    }
    EXPECT_TRUE(std::is_sorted(mine.begin(), mine.begin() + tile.counts.owned));
    EXPECT_TRUE(std::is_sorted(mine.begin() + tile.counts.owned, mine.end()));
    w.triangles.insert(w.triangles.end(), mine.begin(), mine.begin() + tile.counts.owned);
    EXPECT_EQ(tile.extent.border_first, slots);
    slots += tile.extent.border;
    touching.push_back(mine);
  }
  EXPECT_EQ(slots, mesh.layout.border_count);
  EXPECT_EQ(w.positions.size(), mesh.layout.node_count);
  EXPECT_EQ(w.positions.size(), mesh.topology.vertices);
  EXPECT_EQ(w.triangles.size(), mesh.topology.triangles);
  EXPECT_TRUE(std::is_sorted(w.triangles.begin(), w.triangles.end()));

  HaloBoard<std::uint64_t> board(mesh.layout.border_count, ~0ULL);
  std::set<std::uint64_t> in_some_halo;
  for (std::uint32_t t = 0; t < mesh.layout.tile_count(); ++t) {
    const TileExtent& e = mesh.layout.tiles[t];
    const auto border = read(store, fields::kMeshHalo.border, TileId(t));
    EXPECT_EQ(border.size(), e.border);
    EXPECT_TRUE(std::is_sorted(border.begin(), border.end()));
    for (std::uint32_t k = 0; k < border.size(); ++k) {
      board[e.border_first + k] = e.first + border[k];
    }
    const auto halo = read(store, fields::kMeshHalo.halo_ids, TileId(t));
    in_some_halo.insert(halo.begin(), halo.end());
    // Exactly the triangles with an owned corner, and their other corners as the halo.
    std::vector<Corner3> expected;
    std::set<std::uint64_t> expected_halo;
    const auto owns = [&](std::uint64_t v) { return v >= e.first && v < e.first + e.owned; };
    for (const bool home : {true, false}) {
      for (const Corner3& c : w.triangles) {
        if ((owns(c[0]) || owns(c[1]) || owns(c[2])) && owns(c[0]) == home) {
          expected.push_back(c);
          for (const std::uint64_t v : c) {
            if (!owns(v)) {
              expected_halo.insert(v);
            }
          }
        }
      }
    }
    EXPECT_EQ(touching[t], expected);
    EXPECT_TRUE(std::equal(halo.begin(), halo.end(), expected_halo.begin(), expected_halo.end()));
  }
  EXPECT_TRUE(std::equal(board.begin(), board.end(), in_some_halo.begin(), in_some_halo.end()));
  for (std::uint32_t t = 0; t < mesh.layout.tile_count(); ++t) {
    const auto halo = read(store, fields::kMeshHalo.halo_ids, TileId(t));
    const auto halo_slots = read(store, fields::kMeshHalo.halo_slots, TileId(t));
    const auto positions = read(store, fields::kPosition, TileId(t));
    EXPECT_EQ(halo.size(), halo_slots.size());
    for (std::size_t k = 0; k < halo.size(); ++k) {
      EXPECT_EQ(board[halo_slots[k]], halo[k]);
      EXPECT_EQ(positions[mesh.layout.tiles[t].owned + k], w.positions[halo[k]]);
    }
  }
  return w;
}

/// Checks that the mesh is manifold, oriented, of single fans; counts by brute force.
inline void check_topology(const ScanMesh& mesh, const Whole& w) {
  std::map<std::pair<std::uint64_t, std::uint64_t>, std::uint64_t> next_at;  // (vertex, x) -> y
  std::map<std::uint64_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>> star;
  for (const Corner3& t : w.triangles) {
    for (int c = 0; c < 3; ++c) {
      const bool fresh = next_at.insert({{t[c], t[(c + 1) % 3]}, t[(c + 2) % 3]}).second;
      EXPECT_TRUE(fresh) << "an edge has two triangles on one side";
      star[t[c]].emplace_back(t[(c + 1) % 3], t[(c + 2) % 3]);
    }
  }
  EXPECT_EQ(star.size(), w.positions.size()) << "isolated vertices are left";
  std::uint64_t boundary = 0;
  std::vector<std::uint64_t> set(w.positions.size());
  for (std::size_t i = 0; i < set.size(); ++i) {
    set[i] = i;
  }
  std::vector<std::uint64_t> loops = set;
  const auto find = [](std::vector<std::uint64_t>& s, std::uint64_t i) {
    while (s[i] != i) {
      i = s[i] = s[s[i]];
    }
    return i;
  };
  std::vector<std::uint8_t> on_boundary(w.positions.size(), 0);
  for (const auto& [edge, y] : next_at) {
    set[find(set, edge.first)] = find(set, edge.second);
    if (!next_at.contains({edge.second, edge.first})) {
      ++boundary;
      loops[find(loops, edge.first)] = find(loops, edge.second);
      on_boundary[edge.first] = on_boundary[edge.second] = 1;
    }
  }
  for (const auto& [v, wings] : star) {
    // Follow the fan from its start.
    std::uint64_t x = wings[0].first;
    for (const auto& [leaving, arriving] : wings) {
      if (!next_at.contains({leaving, v})) {
        x = leaving;
      }
    }
    const std::uint64_t start = x;
    std::size_t seen = 0;
    while (next_at.contains({v, x})) {
      ++seen;
      x = next_at[{v, x}];
      if (x == start) {
        break;
      }
    }
    EXPECT_EQ(seen, wings.size()) << "vertex " << v << " has several fans";
  }
  std::uint64_t components = 0;
  std::uint64_t boundary_loops = 0;
  for (std::size_t i = 0; i < set.size(); ++i) {
    components += find(set, i) == i ? 1 : 0;
    boundary_loops += on_boundary[i] != 0 && find(loops, i) == i ? 1 : 0;
    EXPECT_EQ(w.flags[i], on_boundary[i] != 0 ? kOnBoundary : 0);
  }
  EXPECT_EQ(mesh.topology.edges, (next_at.size() + boundary) / 2);
  EXPECT_EQ(mesh.topology.components, components);
  EXPECT_EQ(mesh.topology.boundary_loops, boundary_loops);
}

struct Ingested {
  ScanMesh mesh;
  Whole whole;
};

inline Ingested ingest_and_check(const Soup& soup, std::uint32_t tile_size = 8192,
                                 IngestOptions options = {}, int threads = 0) {
  MemoryStore store;
  options.tile_size = tile_size;
  Ingested i;
  i.mesh = ingest(store, soup, options, threads);
  i.whole = read_back(store, i.mesh);
  check_topology(i.mesh, i.whole);
  return i;
}

/// Multiset of triangles by the positions of their corners, the lowest first.
inline std::vector<std::array<std::array<float, 3>, 3>> geometry(const Whole& w) {
  std::vector<std::array<std::array<float, 3>, 3>> g;
  for (const Corner3& t : w.triangles) {
    std::array<std::array<float, 3>, 3> corners;
    for (int c = 0; c < 3; ++c) {
      const Vec3f& p = w.positions[t[c]];
      corners[c] = {p[0], p[1], p[2]};
    }
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    g.push_back(corners);
  }
  std::sort(g.begin(), g.end());
  return g;
}

inline Soup shuffled(const Soup& soup, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::uint64_t> to(soup.positions.size());
  for (std::size_t i = 0; i < to.size(); ++i) {
    to[i] = i;
  }
  std::shuffle(to.begin(), to.end(), random);
  Soup s;
  s.positions.resize(to.size());
  for (std::size_t i = 0; i < to.size(); ++i) {
    s.positions[to[i]] = soup.positions[i];
  }
  for (Corner3 t : soup.triangles) {
    std::rotate(t.begin(), t.begin() + random() % 3, t.end());
    s.triangles.push_back({to[t[0]], to[t[1]], to[t[2]]});
  }
  std::shuffle(s.triangles.begin(), s.triangles.end(), random);
  return s;
}

/// Everything that repair has to deal with, several times over.
inline Soup broken() {
  Soup s = shuffled(joined(torus(20, 14), grid(9, 9, false, false), Vec3d(1.5, 0.5, 0.25)), 3);
  std::mt19937 random(5);
  const std::size_t n = s.triangles.size();
  for (int k = 0; k < 40; ++k) {
    Corner3 t = s.triangles[random() % n];
    s.triangles.push_back(t);  // duplicate
    std::swap(t[0], t[1]);
    s.triangles.push_back(t);  // and turned
    s.triangles.push_back({t[0], t[1], t[1]});
    const std::uint64_t apex = s.add(0.1 * k, 0.2 * k, 3);
    s.triangles.push_back({t[0], t[1], apex});  // a fin: three triangles on an edge
    s.add(0.5 * k, 0, 1);                       // isolated
    s.triangles.push_back({random() % n / 2, random() % n / 2, apex});
  }
  for (int k = 0; k < 60; ++k) {
    Corner3& t = s.triangles[random() % n];
    std::swap(t[1], t[2]);
  }
  const std::uint64_t nan = s.add(std::nan(""), 0, 0);
  s.triangles.push_back({0, 1, nan});
  return s;
}

}  // namespace rattan::testing
