// SPDX-License-Identifier: MIT
#include "engine/mesh/polygon_cutter.h"

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/memory_store.h"
#include "engine/mesh/ingest.h"

namespace rattan {
namespace {

using Triangle = PolygonCutter::Triangle;
using Polygon = std::vector<std::uint64_t>;
using Edge = std::pair<std::uint64_t, std::uint64_t>;

Edge edge(std::uint64_t a, std::uint64_t b) {
  return std::minmax(a, b);
}

struct Result {
  std::vector<Triangle> triangles;
  PolygonCutter::Counts counts;
};

// Starts at the lowest corner, as sinks get polygons.
Polygon turned(Polygon p) {
  std::rotate(p.begin(), std::min_element(p.begin(), p.end()), p.end());
  return p;
}

Result cut(const std::vector<Polygon>& polygons, const std::vector<Triangle>& triangles = {},
           std::uint64_t memory = 1 << 20, std::size_t block = 1 << 12) {
  MemoryStore store;
  PolygonCutter cutter(store, block);
  for (const Polygon& p : polygons) {
    const Polygon q = turned(p);
    const auto size = static_cast<std::uint32_t>(q.size());
    cutter.add(std::span(&size, 1), q);
  }
  Result result;
  result.counts = cutter.cut([&](const auto& f) { f(std::span<const Triangle>(triangles)); },
                             [&](std::span<const Triangle> t) {
                               result.triangles.insert(result.triangles.end(), t.begin(), t.end());
                             },
                             memory);
  return result;
}

std::map<Edge, int> uses(const std::vector<Triangle>& triangles) {
  std::map<Edge, int> count;
  for (const Triangle& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      ++count[edge(t[k], t[(k + 1) % 3])];
    }
  }
  return count;
}

// The rules of the header, with sets.
Result reference(const std::vector<Polygon>& polygons, const std::vector<Triangle>& triangles) {
  std::set<Edge> joined;
  for (const Triangle& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      joined.insert(edge(t[k], t[(k + 1) % 3]));
    }
  }
  for (const Polygon& p : polygons) {
    for (std::size_t k = 0; k < p.size(); ++k) {
      joined.insert(edge(p[k], p[(k + 1) % p.size()]));
    }
  }
  constexpr int kNone = -1;
  std::vector<int> apex_of(polygons.size(), kNone);
  std::vector<bool> dropped(polygons.size(), false);
  const auto fan = [](const Polygon& p, std::size_t apex) {
    std::vector<Edge> diagonals;
    for (std::size_t k = 2; k + 1 < p.size(); ++k) {
      diagonals.push_back(edge(p[apex], p[(apex + k) % p.size()]));
    }
    return diagonals;
  };
  for (std::size_t apex = 0; apex < 8; ++apex) {
    std::map<Edge, std::size_t> owner;
    std::map<std::pair<Edge, Polygon>, std::size_t> same;
    std::vector<std::size_t> winners;
    for (std::size_t q = 0; q < polygons.size(); ++q) {
      const Polygon p = turned(polygons[q]);
      if (apex_of[q] != kNone || dropped[q] || apex >= p.size() || (p.size() == 4 && apex > 1)) {
        continue;
      }
      bool free = true;
      bool repeats = false;
      for (const Edge& e : fan(p, apex)) {
        const bool first = owner.emplace(e, q).second;
        const bool taken = !first || joined.count(e) > 0 || e.first == e.second;
        free = free && !taken;
        repeats = repeats || same.emplace(std::pair(e, p), q).first->second != q;
      }
      dropped[q] = repeats;
      if (free && !repeats) {
        apex_of[q] = static_cast<int>(apex);
        winners.push_back(q);
      }
    }
    for (const std::size_t q : winners) {
      for (const Edge& e : fan(turned(polygons[q]), apex)) {
        joined.insert(e);
      }
    }
  }
  Result result;
  for (std::size_t q = 0; q < polygons.size(); ++q) {
    const Polygon p = turned(polygons[q]);
    if (dropped[q]) {
      result.counts.duplicates += p.size() - 2;
      continue;
    }
    result.counts.stuck += apex_of[q] == kNone ? 1 : 0;
    result.counts.turned += apex_of[q] > 0 ? 1 : 0;
    const auto apex = static_cast<std::size_t>(std::max(apex_of[q], 0));
    for (std::size_t k = 1; k + 1 < p.size(); ++k) {
      result.triangles.push_back({p[apex], p[(apex + k) % p.size()], p[(apex + k + 1) % p.size()]});
    }
  }
  return result;
}

void expect_same(const Result& a, const Result& b) {
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(a.counts.turned, b.counts.turned);
  EXPECT_EQ(a.counts.duplicates, b.counts.duplicates);
  EXPECT_EQ(a.counts.stuck, b.counts.stuck);
}

TEST(PolygonCutter, APillowOfTwoQuadsBecomesATetrahedron) {
  const Result r = cut({{0, 1, 2, 3}, {3, 2, 1, 0}});
  EXPECT_EQ(r.triangles.size(), 4U);
  for (const auto& [e, n] : uses(r.triangles)) {
    EXPECT_EQ(n, 2) << e.first << " " << e.second;
  }
  EXPECT_EQ(r.counts.turned, 1U);
}

TEST(PolygonCutter, QuadsAroundAVertexOfValenceTwoTakeDifferentDiagonals) {
  // 1 lies between the two quads, whose fans around their lowest corners would both join 0 and 2.
  const Result r = cut({{0, 1, 2, 3}, {2, 1, 0, 4}});
  const auto count = uses(r.triangles);
  EXPECT_EQ(std::count_if(count.begin(), count.end(), [](const auto& u) { return u.second > 2; }),
            0);
  std::set<std::set<std::uint64_t>> corners;
  for (const Triangle& t : r.triangles) {
    EXPECT_TRUE(corners.insert({t[0], t[1], t[2]}).second);
  }
}

TEST(PolygonCutter, LeavesEdgesOfTrianglesAlone) {
  const Result r = cut({{0, 1, 2, 3}}, {{0, 2, 4}, {2, 0, 5}});
  EXPECT_EQ(r.triangles, (std::vector<Triangle>{{1, 2, 3}, {1, 3, 0}}));
}

TEST(PolygonCutter, DropsAPolygonThatIsThereTwice) {
  const Result r = cut({{0, 1, 2, 3, 4}, {5, 6, 7, 8}, {2, 3, 4, 0, 1}, {7, 8, 5, 6}});
  EXPECT_EQ(r.triangles.size(), 5U);
  EXPECT_EQ(r.counts.duplicates, 5U);
  EXPECT_EQ(r.counts.turned, 0U);
}

TEST(PolygonCutter, SaysWhereThereIsNoWay) {
  const Result r = cut({{0, 1, 2, 3}}, {{0, 2, 4}, {1, 3, 4}});
  EXPECT_EQ(r.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(r.counts.stuck, 1U);
}

TEST(PolygonCutter, KeepsTheEdgesOfAnyQuadMesh) {
  // A torus of quads so coarse that opposite corners of a face are often joined elsewhere.
  for (const std::uint64_t n : {3, 4, 5, 40}) {
    std::vector<Polygon> quads;
    for (std::uint64_t u = 0; u < n; ++u) {
      for (std::uint64_t v = 0; v < n; ++v) {
        const auto id = [n](std::uint64_t i, std::uint64_t j) { return i % n * n + j % n; };
        quads.push_back({id(u, v), id(u + 1, v), id(u + 1, v + 1), id(u, v + 1)});
      }
    }
    const Result r = cut(quads);
    EXPECT_EQ(r.counts.stuck, 0U);
    for (const auto& [e, count] : uses(r.triangles)) {
      EXPECT_EQ(count, 2) << n << ": " << e.first << " " << e.second;
    }
  }
}

TEST(PolygonCutter, FollowsItsRulesWhateverTheMemory) {
  std::mt19937 random(7);
  for (int round = 0; round < 60; ++round) {
    const std::uint64_t vertices = 6 + random() % 40;
    std::vector<Polygon> polygons;
    std::vector<Triangle> triangles;
    for (int k = 0; k < 30; ++k) {
      Polygon p;
      const std::size_t size = 4 + (random() % 3 == 0 ? random() % 9 : 0);
      while (p.size() < size) {
        const std::uint64_t v = random() % vertices;
        if (p.empty() || (p.back() != v && (p.size() + 1 < size || p.front() != v))) {
          p.push_back(v);
        }
      }
      polygons.push_back(p);
      if (random() % 8 == 0) {
        std::rotate(p.begin(), p.begin() + 2, p.end());
        polygons.push_back(p);
      }
      triangles.push_back({random() % vertices, random() % vertices, random() % vertices});
    }
    const Result expected = reference(polygons, triangles);
    expect_same(cut(polygons, triangles), expected);
    expect_same(cut(polygons, triangles, 1, 8), expected);
  }
}

TEST(PolygonCutter, ManyPolygonsNeedNoTurning) {
  std::vector<Polygon> quads;
  const std::uint64_t n = 60;
  for (std::uint64_t u = 0; u < n; ++u) {
    for (std::uint64_t v = 0; v < n; ++v) {
      quads.push_back(
          {u * (n + 1) + v, (u + 1) * (n + 1) + v, (u + 1) * (n + 1) + v + 1, u * (n + 1) + v + 1});
    }
  }
  const Result r = cut(quads, {}, 1 << 10, 1 << 16);
  EXPECT_EQ(r.triangles.size(), 2 * n * n);
  EXPECT_EQ(r.counts.turned + r.counts.stuck + r.counts.duplicates, 0U);
}

TEST(PolygonCutter, IngestMakesAClosedSurfaceOfAPillow) {
  MemoryStore store;
  Ingest in(store);
  const std::vector<Vec3d> positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0.1}, {0, 1, 0}};
  const std::vector<std::uint32_t> sizes = {4, 4};
  const std::vector<std::uint64_t> corners = {0, 1, 2, 3, 0, 3, 2, 1};
  in.add_vertices(positions);
  in.add_polygons(sizes, corners);
  TaskGraph graph({.threads = 1});
  const ScanMesh mesh = in.finish(graph);
  EXPECT_EQ(mesh.topology.triangles, 4U);
  EXPECT_EQ(mesh.topology.boundary_loops, 0U);
  EXPECT_EQ(mesh.topology.edges, 6U);
  EXPECT_EQ(mesh.repaired.non_manifold_edges, 0U);
}

}  // namespace
}  // namespace rattan
