// SPDX-License-Identifier: MIT
#include "engine/layout/flat_layout.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "engine/core/memory_store.h"
#include "engine/layout/base_complex.h"
#include "engine/remesh/topology.h"
#include "tests/engine/layout/sample_meshes.h"

namespace rattan {
namespace {

using testing::Fields;
using testing::IndexedMesh;

constexpr std::uint32_t kOneTile = 1000000000;

struct Triangle {
  std::array<std::uint64_t, 3> vertex{};
  std::array<Vec2d, 3> uv;
  std::uint32_t chart = 0;
  std::uint32_t part = 0;
};

struct Flat {
  ScanMesh scan;
  ChartLayout layout;
  FlatLayout flat;
  std::vector<Vec3d> vertices;
  std::vector<Triangle> triangles;
  PolygonMesh base;
};

Flat flatten(const IndexedMesh& m, const Fields& fields, double omega, std::uint32_t tile_size,
             int threads = 1, int relax = 0) {
  MemoryStore store;
  Flat out;
  out.scan = testing::store_fields(store, m, fields, tile_size);
  TaskGraph graph({.threads = threads});
  ArrangementOptions options;
  options.omega = omega;
  options.density = 1;
  ChartExtraction report;
  out.layout = *extract_charts(store, out.scan, options, true, graph, report);
  DistortionSums sums;
  out.flat = flatten_layout(store, out.scan, out.layout, omega, relax, graph, sums);
  StoredLayout stored(store, out.scan, out.layout, out.flat, graph);
  stored.for_each_vertices([&](const LayoutVertices& v) {
    EXPECT_EQ(v.first, out.vertices.size());
    out.vertices.insert(out.vertices.end(), v.position.begin(), v.position.end());
  });
  std::uint64_t uvs = 0;
  stored.for_each_chart([&](const LayoutChart& c) {
    EXPECT_EQ(c.first_texture_vertex, uvs);
    uvs += c.uv.size();
    for (std::uint32_t p = 0; p + 1 < c.part_begin.size(); ++p) {
      for (std::uint32_t i = c.part_begin[p]; i < c.part_begin[p + 1]; ++i) {
        Triangle t;
        t.chart = c.chart;
        t.part = c.first_part + p;
        for (std::size_t k = 0; k < 3; ++k) {
          const std::uint32_t v = c.triangle[i][k];
          EXPECT_TRUE(v >= c.part_uv_begin[p] && v < c.part_uv_begin[p + 1]);
          t.vertex[k] = c.vertex[v];
          t.uv[k] = c.uv[v];
          EXPECT_EQ(c.position[v], out.vertices[c.vertex[v]]);
        }
        out.triangles.push_back(t);
      }
    }
  });
  EXPECT_EQ(out.flat.size.vertices, out.vertices.size());
  EXPECT_EQ(out.flat.size.triangles, out.triangles.size());
  EXPECT_EQ(out.flat.size.texture_vertices, uvs);
  out.base = base_complex(out.layout, out.flat);
  return out;
}

/// An edge as one part has it.
struct Half {
  std::uint32_t part = 0;
  Vec2d from, to;
};

/// One surface, no folded triangle, each part a disk, and coordinates that meet at every edge by a
/// quarter turn and whole numbers.
void expect_parameterization(const IndexedMesh& m, const Flat& f) {
  std::map<std::array<std::uint64_t, 2>, Half> halves;
  std::set<std::uint64_t> used;
  for (const Triangle& t : f.triangles) {
    const Vec2d a = t.uv[1] - t.uv[0];
    const Vec2d b = t.uv[2] - t.uv[0];
    EXPECT_GT(a.x() * b.y() - a.y() * b.x(), 0.0) << "chart " << t.chart;
    for (std::size_t k = 0; k < 3; ++k) {
      used.insert(t.vertex[k]);
      const bool fresh =
          halves
              .insert({{t.vertex[k], t.vertex[(k + 1) % 3]}, {t.part, t.uv[k], t.uv[(k + 1) % 3]}})
              .second;
      EXPECT_TRUE(fresh) << "an edge has one triangle on its left";
    }
  }
  std::uint64_t edges = 0;
  for (const auto& [ends, h] : halves) {
    const auto twin = halves.find({ends[1], ends[0]});
    if (twin == halves.end()) {
      ++edges;
      continue;
    }
    if (ends[0] > ends[1]) {
      continue;
    }
    ++edges;
    const Half& o = twin->second;
    double best = 1e9;
    for (int r = 0; r < 4; ++r) {
      const auto turned = [&](Vec2d x) {
        for (int i = 0; i < r; ++i) {
          x = Vec2d(-x.y(), x.x());
        }
        return x;
      };
      const Vec2d one = h.from - turned(o.to);
      const Vec2d two = h.to - turned(o.from);
      const Vec2d whole(std::floor(one.x() + 0.5), std::floor(one.y() + 0.5));
      best = std::min(best, std::max((one - whole).norm(), (two - whole).norm()));
    }
    EXPECT_LT(best, 1e-12) << "parts " << h.part << " and " << o.part;
  }
  std::vector<std::uint32_t> component;
  std::int64_t euler = 0;
  for (const auto& c : testing::topology(m, component)) {
    euler += c.euler;
  }
  EXPECT_EQ(used.size(), f.vertices.size());
  EXPECT_EQ(static_cast<std::int64_t>(f.vertices.size() + f.triangles.size()) -
                static_cast<std::int64_t>(edges),
            euler);
  const MeshTopology base = check_topology(f.base);
  // Where a strand stands for several sides, their ends have two neighbours.
  EXPECT_TRUE(base.simple());
  EXPECT_EQ(base.euler(), euler);
  EXPECT_EQ(base.components, f.scan.topology.components);
  EXPECT_EQ(base.boundary_loops, f.scan.topology.boundary_loops);
  for (std::size_t i = 0; i < f.base.face_count(); ++i) {
    EXPECT_EQ(f.base.degree(i), 4U);
  }
}

bool simple(const IndexedMesh& m) {
  std::set<std::set<std::uint32_t>> seen;
  return std::all_of(m.triangles.begin(), m.triangles.end(), [&](const auto& t) {
    return seen.insert(std::set<std::uint32_t>(t.begin(), t.end())).second;
  });
}

TEST(FlatLayout, HoldsForRandomFields) {
  for (const IndexedMesh& m : testing::all_meshes()) {
    if (!simple(m)) {
      continue;
    }
    for (const double omega : {2.0, 6.0, 40.0}) {
      for (std::uint64_t seed = 0; seed < 2; ++seed) {
        SCOPED_TRACE(m.name + ", omega " + std::to_string(omega) + ", seed " +
                     std::to_string(seed));
        expect_parameterization(
            m, flatten(m, testing::random_fields(m, seed), omega, seed == 0 ? kOneTile : 64U));
        if (::testing::Test::HasFailure()) {
          return;
        }
      }
    }
  }
}

TEST(FlatLayout, HoldsForLinesWithNoise) {
  for (const IndexedMesh& m : testing::all_meshes()) {
    if (!simple(m)) {
      continue;
    }
    for (std::uint64_t seed = 0; seed < 4; ++seed) {
      SCOPED_TRACE(m.name + ", seed " + std::to_string(seed));
      testing::Random random(seed);
      const double omega = 3.0 + 2.0 * static_cast<double>(seed);
      Fields f = testing::linear_fields(m, Vec3d(0.7, 0.2, 0.5), omega);
      const Fields noise = testing::random_fields(m, seed);
      for (std::size_t v = 0; v < f.frames.size(); ++v) {
        if (random.next() < 0.03) {
          f.phases[v] = noise.phases[v];
        }
      }
      const Flat one = flatten(m, f, omega, 50);
      expect_parameterization(m, one);
      expect_parameterization(m, flatten(m, f, omega, 50, 2, 3));
      const Flat two = flatten(m, f, omega, 50, 2);
      EXPECT_EQ(one.vertices, two.vertices);
      EXPECT_EQ(one.base.positions, two.base.positions);
      if (::testing::Test::HasFailure()) {
        return;
      }
    }
  }
}

TEST(FlatLayout, KeepsWholeChartsAsTheyAre) {
  const IndexedMesh m = testing::grid(40, 40);
  const double omega = 8.0;
  const Fields f = testing::linear_fields(m, Vec3d(1.0, 0.0, 0.0), omega);
  const Flat flat = flatten(m, f, omega, 64);
  expect_parameterization(m, flat);
  EXPECT_EQ(flat.flat.counts.singular, 0U);
  EXPECT_GT(flat.flat.counts.unfolded, flat.flat.counts.charts / 3);
}

}  // namespace
}  // namespace rattan
