// SPDX-License-Identifier: MIT
#include "engine/layout/chart_extraction.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include <gtest/gtest.h>

#include "engine/core/memory_store.h"
#include "tests/engine/layout/sample_meshes.h"

namespace rattan {
namespace {

using testing::Fields;
using testing::IndexedMesh;

constexpr std::uint32_t kOneTile = 1000000000;

struct Charts {
  ChartLayout layout;
  ChartExtraction report;
  std::vector<ChartMesh> meshes;
};

/// Without triangles back to back: cut along the same lines, both sides get the same diagonals, and
/// edges are no longer known by their ends.
std::vector<IndexedMesh> meshes() {
  std::vector<IndexedMesh> list;
  for (IndexedMesh& m : testing::all_meshes()) {
    std::set<std::set<std::uint32_t>> seen;
    const bool simple = std::all_of(m.triangles.begin(), m.triangles.end(), [&](const auto& t) {
      return seen.insert(std::set<std::uint32_t>(t.begin(), t.end())).second;
    });
    if (simple) {
      list.push_back(std::move(m));
    }
  }
  return list;
}

Charts extract(const IndexedMesh& m, const Fields& fields, double omega, std::uint32_t tile_size,
               int threads = 1) {
  MemoryStore store;
  const ScanMesh mesh = testing::store_fields(store, m, fields, tile_size);
  TaskGraph graph({.threads = threads});
  ArrangementOptions options;
  options.omega = omega;
  options.density = 1;
  Charts out;
  out.layout = *extract_charts(store, mesh, options, true, graph, out.report);
  for (std::uint32_t t = 0; t < mesh.layout.tile_count(); ++t) {
    for (ChartMesh& c : assemble_charts(load_pieces(store, out.layout, TileId(t)), out.layout,
                                        TileId(t), mesh.has_colours)) {
      out.meshes.push_back(std::move(c));
    }
  }
  return out;
}

double area(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  return 0.5 * (b - a).cross(c - a).norm();
}

/// The charts are a triangulation of the whole surface, each a disk (load_charts makes sure), and
/// their rims are what the graph says.
void expect_layout(const IndexedMesh& m, const Charts& charts) {
  const ChartGraph& g = charts.layout.graph;
  ASSERT_EQ(charts.meshes.size(), g.chart_count());
  std::map<std::array<std::uint64_t, 2>, int> directed;
  std::set<std::uint64_t> vertices;
  std::uint64_t triangles = 0;
  double sum = 0.0;
  double most = 0.0;
  for (const ChartMesh& c : charts.meshes) {
    std::map<std::uint32_t, std::uint64_t> rim;
    for (std::size_t t = 0; t < c.triangle.size(); ++t) {
      const auto& v = c.triangle[t];
      ++triangles;
      sum += area(c.position[v[0]], c.position[v[1]], c.position[v[2]]);
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint64_t from = c.number[v[k]];
        const std::uint64_t to = c.number[v[(k + 1) % 3]];
        EXPECT_NE(from, to);
        vertices.insert(from);
        ++directed[{from, to}];
        if (c.dart[t][k] != kInsideChart) {
          ++rim[c.dart[t][k]];
          EXPECT_EQ(g.strands[c.dart[t][k] >> 1].chart[c.dart[t][k] & 1U], c.chart);
        }
      }
    }
    std::set<std::uint32_t> ring(g.ring(c.chart).begin(), g.ring(c.chart).end());
    EXPECT_EQ(ring.size(), g.ring(c.chart).size());
    for (const auto& [dart, n] : rim) {
      EXPECT_TRUE(ring.contains(dart));
    }
    EXPECT_EQ(rim.size(), ring.size());
    EXPECT_GE(g.sides(c.chart), 3U);
    if (!c.unfolded.empty()) {
      double least = 1.0;
      for (const auto& v : c.triangle) {
        const Vec2d a = c.unfolded[v[1]] - c.unfolded[v[0]];
        const Vec2d b = c.unfolded[v[2]] - c.unfolded[v[0]];
        least = std::min(least, a.x() * b.y() - a.y() * b.x());
        for (const std::uint32_t i : v) {
          most = std::max({most, -c.unfolded[i].x(), c.unfolded[i].x() - 1.0, -c.unfolded[i].y(),
                           c.unfolded[i].y() - 1.0});
        }
      }
      EXPECT_GT(least, -1e-4) << c.chart;
    }
  }
  EXPECT_LT(most, 1e-3);
  double whole = 0.0;
  for (const auto& t : m.triangles) {
    whole += area(m.positions[t[0]], m.positions[t[1]], m.positions[t[2]]);
  }
  EXPECT_NEAR(sum, whole, 1e-5 * whole);
  std::uint64_t edges = 0;
  for (const auto& [edge, n] : directed) {
    EXPECT_EQ(n, 1);
    if (edge[0] < edge[1] || !directed.contains({edge[1], edge[0]})) {
      ++edges;
    }
  }
  std::vector<std::uint32_t> component;
  std::int64_t euler = 0;
  for (const auto& c : testing::topology(m, component)) {
    euler += c.euler;
  }
  EXPECT_EQ(
      static_cast<std::int64_t>(vertices.size() + triangles) - static_cast<std::int64_t>(edges),
      euler);
  EXPECT_LT(*vertices.rbegin(), g.first_division);
  EXPECT_EQ(vertices.size(), g.first_division);  // every number is used
  // The graph itself.
  const auto nodes = static_cast<std::int64_t>(g.node_vertex.size());
  std::int64_t open = 0;
  for (const ChartStrand& s : g.strands) {
    open += s.closed() ? 0 : 1;
  }
  EXPECT_EQ(nodes - open + static_cast<std::int64_t>(g.chart_count()), euler);
  for (const std::uint64_t v : g.node_vertex) {
    EXPECT_TRUE(vertices.contains(v));
  }
}

TEST(ChartExtraction, CutsTheSurfaceIntoDisksForRandomFields) {
  for (const IndexedMesh& m : meshes()) {
    for (const double omega : {0.7, 2.0, 6.0, 40.0}) {
      for (std::uint64_t seed = 0; seed < 3; ++seed) {
        SCOPED_TRACE(m.name + ", omega " + std::to_string(omega) + ", seed " +
                     std::to_string(seed));
        expect_layout(m, extract(m, testing::random_fields(m, seed), omega,
                                 seed == 0 ? kOneTile : 7U + static_cast<std::uint32_t>(seed)));
        if (::testing::Test::HasFailure()) {
          return;
        }
      }
    }
  }
}

/// What doesn't depend on numbers: for each chart, sorted, its triangles' places.
std::vector<std::vector<std::array<double, 3>>> shapes(const Charts& charts) {
  std::vector<std::vector<std::array<double, 3>>> out;
  for (const ChartMesh& c : charts.meshes) {
    auto& shape = out.emplace_back();
    for (const auto& t : c.triangle) {
      const Vec3d mid = c.position[t[0]] + c.position[t[1]] + c.position[t[2]];
      shape.push_back(
          {std::round(1e4 * mid.x()), std::round(1e4 * mid.y()), std::round(1e4 * mid.z())});
    }
    std::sort(shape.begin(), shape.end());
  }
  std::sort(out.begin(), out.end());
  return out;
}

TEST(ChartExtraction, DoesNotDependOnTilesOrThreads) {
  for (const IndexedMesh& m : meshes()) {
    for (const double omega : {2.0, 8.0, 1000.0}) {
      SCOPED_TRACE(m.name + ", omega " + std::to_string(omega));
      const Fields f = testing::random_fields(m, 11);
      const Charts one = extract(m, f, omega, kOneTile);
      for (const std::uint32_t size : {3U, 17U, 64U}) {
        for (const int threads : {1, 2}) {
          const Charts tiled = extract(m, f, omega, size, threads);
          expect_layout(m, tiled);
          EXPECT_EQ(shapes(one), shapes(tiled)) << "tiles of " << size;
          EXPECT_EQ(one.layout.singular_charts, tiled.layout.singular_charts);
          EXPECT_EQ(one.report.not_disks, tiled.report.not_disks);
          if (::testing::Test::HasFailure()) {
            return;
          }
        }
      }
    }
  }
}

TEST(ChartExtraction, UnfoldsRegularCharts) {
  // A flat plate with straight lines: whole charts are squares, and stay what they are in space.
  const IndexedMesh m = testing::grid(40, 40);
  const double omega = 7.3;
  for (const double turn : {0.0, 0.4}) {
    const Vec3d along(std::cos(turn), std::sin(turn), 0.0);
    const Fields f = testing::linear_fields(m, along, omega);
    for (const std::uint32_t size : {kOneTile, 64U}) {
      const Charts charts = extract(m, f, omega, size);
      expect_layout(m, charts);
      EXPECT_EQ(charts.report.not_disks, 0U);
      EXPECT_EQ(charts.layout.singular_charts, 0U);
      int whole = 0;
      for (const ChartMesh& c : charts.meshes) {
        if (c.unfolded.empty()) {
          continue;
        }
        ++whole;
        for (const auto& t : c.triangle) {
          for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t i = t[k];
            const std::uint32_t j = t[(k + 1) % 3];
            EXPECT_NEAR((c.unfolded[i] - c.unfolded[j]).norm(),
                        (c.position[i] - c.position[j]).norm() / omega, 0.01);
          }
        }
      }
      EXPECT_GE(whole, 12);
    }
  }
}

}  // namespace
}  // namespace rattan
