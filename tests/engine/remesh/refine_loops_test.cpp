// SPDX-License-Identifier: MIT
#include "engine/remesh/refine_loops.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/memory_store.h"
#include "engine/mesh/ingest.h"
#include "engine/remesh/topology.h"
#include "engine/remesh/vertex_stars.h"
#include "tests/engine/remesh/scan_shapes.h"

namespace rattan {
namespace {

constexpr double kPi = 3.14159265358979323846;

Vec3d on_circle(double radius, double share) {
  return {radius * std::cos(2 * kPi * share), radius * std::sin(2 * kPi * share), 0.0};
}

/// A ring from radius 1 to 3; every other vertex of the inner circle lies `jag` further out.
test::Soup ring_scan(std::uint32_t around, double jag) {
  test::Soup s;
  constexpr std::uint32_t kRings = 4;
  for (std::uint32_t r = 0; r <= kRings; ++r) {
    for (std::uint32_t i = 0; i < around; ++i) {
      const double radius = 1.0 + 2.0 * r / kRings + (r == 0 && i % 2 == 1 ? jag : 0.0);
      s.positions.push_back(on_circle(radius, double(i) / around).cast<float>().cast<double>());
    }
  }
  for (std::uint32_t r = 0; r < kRings; ++r) {
    for (std::uint32_t i = 0; i < around; ++i) {
      const std::uint32_t a = r * around + i, b = r * around + (i + 1) % around;
      s.triangles.push_back({a, a + around, b + around});
      s.triangles.push_back({a, b + around, b});
    }
  }
  return s;
}

PolygonMesh ring_of_quads(std::uint32_t around) {
  PolygonMesh m;
  for (const double radius : {1.0, 3.0}) {
    for (std::uint32_t i = 0; i < around; ++i) {
      m.positions.push_back(on_circle(radius, (i + 0.1) / around));
    }
  }
  for (std::uint32_t i = 0; i < around; ++i) {
    const std::uint32_t j = (i + 1) % around;
    m.add_face(std::array<std::uint32_t, 4>{i, i + around, j + around, j});
  }
  return m;
}

/// How far the boundary's edges near the inner circle leave it.
double inner_deviation(const PolygonMesh& m) {
  double worst = 0.0;
  const VertexStars stars(m);
  for (std::size_t v = 0; v < m.vertex_count(); ++v) {
    if (stars.on_boundary[v] != 0 && m.positions[v].norm() < 2.0) {
      const Vec3d& q = m.positions[stars.boundary[v][1]];
      for (const double t : {0.0, 0.25, 0.5}) {
        const Vec3d x = m.positions[v] + t * (q - m.positions[v]);
        worst = std::max(worst, std::abs(x.norm() - 1.0));
      }
    }
  }
  return worst;
}

class RefineLoops : public testing::Test {
 protected:
  RefineLoops() { scan(0.0); }
  void scan(double jag, bool all = false) {
    MemoryStore store;
    TaskGraph graph;
    const test::Soup s = ring_scan(96, jag);
    const ScanMesh mesh = tile_indexed_mesh(store, s.positions, s.triangles, 50);
    curve_ = std::make_unique<BoundaryCurve>(store, mesh, graph);
    loops_ = std::make_unique<BoundaryLoops>(*curve_, all);
  }
  std::unique_ptr<BoundaryCurve> curve_;
  std::unique_ptr<BoundaryLoops> loops_;
};

void expect_ring(const PolygonMesh& m) {
  const MeshTopology t = check_topology(m);
  EXPECT_TRUE(t.clean());
  EXPECT_EQ(t.components, 1U);
  EXPECT_EQ(t.boundary_loops, 2U);
  EXPECT_EQ(t.euler(), 0);
}

TEST_F(RefineLoops, LoopsAreInOrderWithTheSurfaceOnTheLeft) {
  ASSERT_EQ(loops_->size(), 2U);
  for (std::size_t l = 0; l < 2; ++l) {
    const std::vector<Vec3d>& p = loops_->corners(l);
    ASSERT_EQ(p.size(), 96U);
    EXPECT_TRUE(loops_->is_smooth(l));
    const double radius = p[0].norm();
    EXPECT_NEAR(loops_->length(l), 2 * kPi * radius, 0.01);
    for (std::size_t k = 0; k < p.size(); ++k) {
      const double turn = p[k].cross(p[(k + 1) % p.size()]).z();
      EXPECT_GT(radius < 2.0 ? -turn : turn, 0.0);
    }
  }
}

TEST_F(RefineLoops, ShortLoopsGetTheFewestVertices) {
  for (const double tolerance : {0.2, 0.05, 0.01}) {
    PolygonMesh m = ring_of_quads(4);
    const std::uint64_t added = reshape_short_loops(m, *curve_, *loops_, 10.0, tolerance);
    expect_ring(m);
    EXPECT_LE(inner_deviation(m), tolerance + 1e-3);
    // n chords half outside a unit circle leave half of 1 - cos(pi / n); a little more is allowed.
    const double n = kPi / std::acos(1.0 - 2.0 * tolerance);
    EXPECT_LE(4.0 + static_cast<double>(added), std::max(4.0, std::ceil(1.3 * n + 1.0)));
    std::size_t corners = 0;
    for (const std::uint8_t flag : m.vertex_flags) {
      corners += (flag & kCornerVertex) != 0 ? 1 : 0;
    }
    EXPECT_EQ(corners, 4 + added);  // the outer loop is long
  }
}

TEST_F(RefineLoops, LongLoopsAreDividedWhereTheyBend) {
  PolygonMesh m = ring_of_quads(8);
  EXPECT_GT(inner_deviation(m), 0.05);
  EXPECT_GT(refine_loops(m, *curve_, *loops_, 0.02), 8U);
  expect_ring(m);
  EXPECT_LE(inner_deviation(m), 0.021);
  EXPECT_EQ(refine_loops(m, *curve_, *loops_, 0.02), 0U);
}

TEST_F(RefineLoops, JaggedLoopsStay) {
  scan(0.08);
  EXPECT_FALSE(loops_->is_smooth(0) && loops_->is_smooth(1));
  PolygonMesh m = ring_of_quads(8);
  const std::vector<Vec3d> before(m.positions.begin(), m.positions.begin() + 8);
  reshape_short_loops(m, *curve_, *loops_, 10.0, 0.02);
  refine_loops(m, *curve_, *loops_, 0.02);
  expect_ring(m);
  EXPECT_TRUE(std::equal(before.begin(), before.end(), m.positions.begin()));
  EXPECT_GT(inner_deviation(m), 0.05);
}

TEST_F(RefineLoops, JaggedLoopsThatCountGetTheirCorners) {
  scan(0.08, true);
  PolygonMesh m = ring_of_quads(8);
  EXPECT_GE(reshape_short_loops(m, *curve_, *loops_, 0.0, 0.02), 88U);
  expect_ring(m);
  std::size_t ragged = 0;
  for (std::size_t l = 0; l < 2; ++l) {
    EXPECT_TRUE(loops_->is_smooth(l));
    if (!loops_->is_ragged(l)) {
      continue;
    }
    ++ragged;
    for (const Vec3d& p : loops_->corners(l)) {
      EXPECT_TRUE(std::any_of(m.positions.begin(), m.positions.end(),
                              [&](const Vec3d& q) { return (p - q).norm() < 0.02; }));
    }
  }
  EXPECT_EQ(ragged, 1U);
}

TEST_F(RefineLoops, FoldedEarsAreUnfolded) {
  // The diagonal of the lower left corner of a square, taken over the other diagonal: the ear at
  // the corner lies over its neighbour.
  PolygonMesh m;
  m.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  m.positions[0] = {0.8, 0.8, 0};
  m.add_face(std::array<std::uint32_t, 3>{0, 1, 3});
  m.add_face(std::array<std::uint32_t, 3>{1, 2, 3});
  EXPECT_EQ(unfold_ears(m), 1U);
  EXPECT_TRUE(check_topology(m).clean());
  PolygonMesh plain = ring_of_quads(8);
  EXPECT_EQ(unfold_ears(plain), 0U);
  EXPECT_EQ(plain.face_count(), 8U);
}

}  // namespace
}  // namespace rattan
