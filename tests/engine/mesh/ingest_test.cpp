// SPDX-License-Identifier: MIT
#include "engine/mesh/ingest.h"

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "engine/core/memory_store.h"

namespace rattan {
namespace {

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
Soup grid(std::uint32_t nu, std::uint32_t nv, bool wrap_u, bool wrap_v) {
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

Soup torus(std::uint32_t nu, std::uint32_t nv) {
  return grid(nu, nv, true, true);
}

Soup joined(const Soup& a, const Soup& b, const Vec3d& shift) {
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

ScanMesh ingest(Store& store, const Soup& soup, IngestOptions options = {}, int threads = 0) {
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
Whole read_back(Store& store, const ScanMesh& mesh) {
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
void check_topology(const ScanMesh& mesh, const Whole& w) {
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

Ingested ingest_and_check(const Soup& soup, std::uint32_t tile_size = 8192,
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
std::vector<std::array<std::array<float, 3>, 3>> geometry(const Whole& w) {
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

Soup shuffled(const Soup& soup, unsigned seed) {
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

TEST(Ingest, CountsOfKnownSurfaces) {
  const auto t = ingest_and_check(torus(24, 16), 50).mesh;
  EXPECT_EQ(t.topology.euler(), 0);
  EXPECT_EQ(t.topology.components, 1U);
  EXPECT_EQ(t.topology.boundary_loops, 0U);
  const auto tube = ingest_and_check(grid(24, 16, true, false), 50).mesh;
  EXPECT_EQ(tube.topology.euler(), 0);
  EXPECT_EQ(tube.topology.boundary_loops, 2U);
  const auto patch = ingest_and_check(grid(24, 16, false, false), 50).mesh;
  EXPECT_EQ(patch.topology.euler(), 1);
  EXPECT_EQ(patch.topology.boundary_loops, 1U);
  const auto both =
      ingest_and_check(joined(torus(12, 9), grid(5, 4, true, false), Vec3d(9, 0, 0)), 32).mesh;
  EXPECT_EQ(both.topology.components, 2U);
  EXPECT_EQ(both.topology.boundary_loops, 2U);
  EXPECT_EQ(both.repaired.split_vertices, 0U);
  EXPECT_EQ(both.repaired.non_manifold_edges, 0U);
  EXPECT_EQ(both.repaired.flipped_triangles, 0U);
}

TEST(Ingest, MeasuresOfAFlatSquare) {
  Soup s = grid(10, 20, false, false);
  for (Vec3d& p : s.positions) {
    p[2] = 0;
  }
  const auto m = ingest_and_check(s, 40).mesh;
  EXPECT_NEAR(m.area, 200.0, 1e-9);
  EXPECT_NEAR(m.mean_edge_length, (2 + std::sqrt(2.0)) / 3, 1e-9);
  EXPECT_EQ(m.box_min, Vec3d(0, 0, 0));
  EXPECT_EQ(m.box_max, Vec3d(10, 20, 0));
  EXPECT_EQ(m.origin, Vec3d(0, 0, 0));
}

TEST(Ingest, TileSizeDecidesOnlyTheCuts) {
  const Soup s = joined(torus(30, 20), grid(12, 12, false, false), Vec3d(6, 0, 0));
  const auto one = ingest_and_check(s, 1000000000);
  EXPECT_EQ(one.mesh.layout.tile_count(), 1U);
  for (const std::uint32_t size : {1U, 7U, 32U, 64U, 100U}) {
    const auto many = ingest_and_check(s, size);
    EXPECT_GT(many.mesh.layout.tile_count(), 5U);
    EXPECT_EQ(many.whole, one.whole) << size;
    EXPECT_NEAR(many.mesh.area, one.mesh.area, 1e-9 * one.mesh.area);
  }
}

/// Everything that repair has to deal with, several times over.
Soup broken() {
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

TEST(Ingest, RepairsTheSameWhateverTheMemoryAndTheThreads) {
  const Soup s = broken();
  for (const std::uint32_t tile_size : {16U, 100000U}) {
    const auto one = ingest_and_check(s, tile_size);
    EXPECT_GT(one.mesh.repaired.degenerate_triangles, 39U);
    EXPECT_GT(one.mesh.repaired.duplicate_triangles, 70U);
    EXPECT_GT(one.mesh.repaired.non_manifold_edges, 20U);
    EXPECT_GT(one.mesh.repaired.split_vertices, 20U);
    EXPECT_GT(one.mesh.repaired.flipped_triangles, 20U);
    EXPECT_EQ(one.mesh.repaired.isolated_vertices, 40U);
    EXPECT_EQ(one.mesh.repaired.non_finite_vertices, 1U);
    for (const std::uint64_t memory : {1U, 3000U}) {
      IngestOptions tiny;
      tiny.memory_bytes = memory;
      tiny.spool_block_bytes = 100;
      tiny.wide_ids = memory == 1;
      const auto many = ingest_and_check(s, tile_size, tiny, memory == 1 ? 1 : 4);
      EXPECT_EQ(many.whole, one.whole);
      EXPECT_EQ(many.mesh.area, one.mesh.area);
      EXPECT_EQ(many.mesh.mean_edge_length, one.mesh.mean_edge_length);
      EXPECT_EQ(many.mesh.repaired.flipped_triangles, one.mesh.repaired.flipped_triangles);
      EXPECT_EQ(many.mesh.repaired.non_manifold_edges, one.mesh.repaired.non_manifold_edges);
    }
  }
  const auto small = ingest_and_check(s, 16);
  const auto large = ingest_and_check(s, 100000);
  EXPECT_EQ(small.whole, large.whole);
  EXPECT_EQ(small.mesh.repaired.flipped_triangles, large.mesh.repaired.flipped_triangles);
  EXPECT_EQ(small.mesh.repaired.split_vertices, large.mesh.repaired.split_vertices);
  EXPECT_EQ(small.mesh.repaired.non_manifold_edges, large.mesh.repaired.non_manifold_edges);
  EXPECT_EQ(small.mesh.repaired.isolated_vertices, large.mesh.repaired.isolated_vertices);
}

TEST(Ingest, OrderOfTheInputDoesNotMatter) {
  const Soup s = joined(torus(30, 20), grid(12, 12, false, false), Vec3d(6, 0, 0));
  const auto first = ingest_and_check(s, 64);
  const auto second = ingest_and_check(shuffled(s, 1), 64);
  EXPECT_EQ(first.whole, second.whole);
  EXPECT_EQ(geometry(first.whole).size(), s.triangles.size());
}

TEST(Ingest, TrianglesSurviveUnchanged) {
  const Soup s = shuffled(torus(30, 20), 2);
  Whole direct;
  for (const Vec3d& p : s.positions) {
    direct.positions.push_back(p.cast<float>());
  }
  direct.triangles = s.triangles;
  EXPECT_EQ(geometry(ingest_and_check(s, 64).whole), geometry(direct));
}

TEST(Ingest, TurnedTrianglesFollowTheMajority) {
  Soup s = torus(16, 12);
  const auto straight = geometry(ingest_and_check(s, 20).whole);
  for (std::size_t t = 0; t < s.triangles.size(); t += 3) {
    std::swap(s.triangles[t][0], s.triangles[t][1]);
  }
  for (const std::uint32_t size : {20U, 1000U}) {
    const auto turned = ingest_and_check(s, size);
    EXPECT_EQ(turned.mesh.repaired.flipped_triangles, (s.triangles.size() + 2) / 3);
    EXPECT_EQ(turned.mesh.repaired.non_manifold_edges, 0U);
    EXPECT_EQ(turned.mesh.topology.euler(), 0);
    EXPECT_EQ(geometry(turned.whole), straight);
  }
}

TEST(Ingest, AMoebiusStripIsCutOnce) {
  constexpr std::uint32_t kAround = 24;
  constexpr std::uint32_t kAcross = 3;
  Soup s;
  for (std::uint32_t u = 0; u < kAround; ++u) {
    for (std::uint32_t v = 0; v <= kAcross; ++v) {
      const double a = 2 * 3.14159265358979 * u / kAround;
      const double w = 0.4 * (v - 1.5);
      const double r = 2 + w * std::cos(a / 2);
      s.add(r * std::cos(a), r * std::sin(a), w * std::sin(a / 2));
    }
  }
  const auto id = [&](std::uint32_t u, std::uint32_t v) -> std::uint64_t {
    return u < kAround ? u * (kAcross + 1) + v : kAcross - v;
  };
  for (std::uint32_t u = 0; u < kAround; ++u) {
    for (std::uint32_t v = 0; v < kAcross; ++v) {
      s.quad(id(u, v), id(u + 1, v), id(u + 1, v + 1), id(u, v + 1));
    }
  }
  for (const std::uint32_t size : {8U, 30U, 1000U}) {
    const auto m = ingest_and_check(s, size).mesh;
    EXPECT_EQ(m.repaired.flipped_triangles, 0U);
    EXPECT_EQ(m.repaired.non_manifold_edges, kAcross);
    EXPECT_EQ(m.repaired.split_vertices, kAcross + 1);
    EXPECT_EQ(m.topology.components, 1U);
    EXPECT_EQ(m.topology.boundary_loops, 1U);
    EXPECT_EQ(m.topology.euler(), 1);
  }
}

TEST(Ingest, ThreePagesOfABookComeApart) {
  Soup s;
  const auto a = s.add(0, 0, 0);
  const auto b = s.add(0, 0, 1);
  for (int k = 0; k < 3; ++k) {
    s.triangles.push_back({a, b, s.add(std::cos(2.0 * k), std::sin(2.0 * k), 0.5)});
  }
  for (const std::uint32_t size : {1U, 2U, 100U}) {
    const auto m = ingest_and_check(s, size).mesh;
    EXPECT_EQ(m.repaired.non_manifold_edges, 1U);
    EXPECT_EQ(m.repaired.split_vertices, 4U);
    EXPECT_EQ(m.topology.components, 3U);
    EXPECT_EQ(m.topology.vertices, 9U);
  }
}

TEST(Ingest, AFinLeavesTheSurfaceClosed) {
  Soup s = torus(12, 8);
  const std::uint64_t apex = s.add(0, 0, 9);
  s.triangles.push_back({s.triangles[10][0], s.triangles[10][1], apex});
  for (const std::uint32_t size : {5U, 1000U}) {
    const auto m = ingest_and_check(s, size).mesh;
    EXPECT_EQ(m.topology.components, 2U);
    EXPECT_EQ(m.topology.boundary_loops, 1U);
    EXPECT_EQ(m.topology.euler(), 1);
    EXPECT_EQ(m.repaired.split_vertices, 2U);
  }
}

TEST(Ingest, ConesThatShareAnApexGetTheirOwn) {
  Soup s;
  const auto apex = s.add(0, 0, 0);
  constexpr std::uint32_t kSides = 20;  // more than the fast path for fans takes
  for (const double z : {-1.0, 1.0}) {
    const std::uint64_t first = s.positions.size();
    for (std::uint32_t k = 0; k < kSides; ++k) {
      s.add(std::cos(0.1 * k), std::sin(0.1 * k), z);
    }
    for (std::uint32_t k = 0; k < kSides; ++k) {
      s.triangles.push_back({apex, first + k, first + (k + 1) % kSides});
    }
  }
  for (const std::uint32_t size : {4U, 1000U}) {
    const auto m = ingest_and_check(s, size).mesh;
    EXPECT_EQ(m.repaired.split_vertices, 1U);
    EXPECT_EQ(m.topology.components, 2U);
    EXPECT_EQ(m.topology.boundary_loops, 2U);
    EXPECT_EQ(m.topology.euler(), 2);
  }
}

TEST(Ingest, ZeroAreaTrianglesStay) {
  Soup s;
  s.add(0, 0, 0);
  s.add(1, 0, 0);
  s.add(2, 0, 0);
  s.triangles.push_back({0, 1, 2});
  EXPECT_EQ(ingest_and_check(s).mesh.topology.triangles, 1U);
}

TEST(Ingest, FarCoordinatesKeepTheirDetail) {
  Soup s = grid(20, 20, false, false);
  for (Vec3d& p : s.positions) {
    p = p * 0.01 + Vec3d(4.5e6, -3.25e5, 812.0);
  }
  const auto i = ingest_and_check(s, 50);
  std::vector<std::array<double, 3>> expected;
  std::vector<std::array<double, 3>> actual;
  for (const Vec3d& p : s.positions) {
    expected.push_back({p[0], p[1], p[2]});
  }
  for (const Vec3f& p : i.whole.positions) {
    const Vec3d q = p.cast<double>() + i.mesh.origin;
    actual.push_back({q[0], q[1], q[2]});
  }
  std::sort(expected.begin(), expected.end());
  std::sort(actual.begin(), actual.end());
  ASSERT_EQ(expected.size(), actual.size());
  for (const auto& e : expected) {
    double best = 1;
    for (const auto& a : actual) {
      best = std::min(
          best, std::max({std::abs(e[0] - a[0]), std::abs(e[1] - a[1]), std::abs(e[2] - a[2])}));
    }
    EXPECT_LT(best, 2e-8);
  }
}

TEST(Ingest, OriginIsExactFor32BitCoordinates) {
  EXPECT_EQ(choose_origin(Vec3d(-1, -1, 2), Vec3d(1, 1, 3)), Vec3d(0, 0, 0));
  const Vec3d low(4500000.25, 0.1, 1e10);
  const Vec3d high(4500000.75, 0.9, 1e10);
  const Vec3d o = choose_origin(low, high);
  for (const float x : {4500000.25F, 4500000.5F, 4500000.75F}) {
    const double d = static_cast<double>(x) - o[0];
    EXPECT_EQ(static_cast<double>(static_cast<float>(d)), d);
    EXPECT_LT(std::abs(d), 2.0);
  }
  EXPECT_EQ(o[1], 0.0);
}

TEST(Ingest, BadIndicesAndEmptyScansAreTheInputsFault) {
  MemoryStore store;
  TaskGraph graph;
  Soup s = grid(3, 3, false, false);
  s.triangles[7][1] = 16;
  IngestOptions options;
  options.input_name = "dog.ply";
  try {
    ingest(store, s, options);
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("dog.ply: triangle 7: refers to vertex 16"),
              std::string::npos);
  }
  s.triangles[7][1] = 1ULL << 40;
  EXPECT_THROW(ingest(store, s, options), InputError);
  EXPECT_THROW(ingest(store, Soup{}), InputError);
  Soup points;
  points.add(1, 2, 3);
  EXPECT_THROW(ingest(store, points), InputError);
}

TEST(Ingest, AgreesWithTheInMemoryTiler) {
  const auto i =
      ingest_and_check(joined(torus(20, 15), grid(5, 6, true, false), Vec3d(9, 0, 0)), 40);
  std::vector<Vec3d> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (const Vec3f& p : i.whole.positions) {
    positions.push_back(p.cast<double>());
  }
  for (const Corner3& t : i.whole.triangles) {
    triangles.push_back({static_cast<std::uint32_t>(t[0]), static_cast<std::uint32_t>(t[1]),
                         static_cast<std::uint32_t>(t[2])});
  }
  MemoryStore store;
  const ScanMesh direct = tile_indexed_mesh(store, positions, triangles, 40);
  EXPECT_EQ(read_back(store, direct), i.whole);
  check_topology(direct, i.whole);
  EXPECT_EQ(direct.topology.edges, i.mesh.topology.edges);
  EXPECT_NEAR(direct.area, i.mesh.area, 1e-9 * direct.area);
  EXPECT_NEAR(direct.mean_edge_length, i.mesh.mean_edge_length, 1e-9 * direct.mean_edge_length);
}

TEST(Ingest, LeavesNoScratchBehind) {
  class CountingStore final : public Store {
   public:
    void write_chunk(std::string_view field, TileId tile, ChunkBytes bytes) override {
      names.insert(std::string(field));
      store.write_chunk(field, tile, std::move(bytes));
    }
    ChunkBytes read_chunk(std::string_view field, TileId tile) override {
      return store.read_chunk(field, tile);
    }
    bool has_chunk(std::string_view field, TileId tile) const override {
      return store.has_chunk(field, tile);
    }
    void erase(std::string_view field) override {
      names.erase(std::string(field));
      store.erase(field);
    }
    MemoryStore store;
    std::set<std::string> names;
  };
  CountingStore store;
  IngestOptions options;
  options.memory_bytes = 2000;
  ingest(store, broken(), options);
  for (const std::string& name : store.names) {
    EXPECT_TRUE(name.starts_with("mesh/")) << name;
  }
}

}  // namespace
}  // namespace rattan
