// SPDX-License-Identifier: MIT
#include "engine/remesh/untangle.h"

#include <cmath>
#include <functional>

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <oneapi/tbb/task_arena.h>

#include "engine/core/memory_store.h"
#include "engine/remesh/mend_quads.h"
#include "engine/remesh/quality.h"
#include "engine/remesh/topology.h"
#include "tests/engine/remesh/scan_shapes.h"

namespace rattan {
namespace {

using test::distance_to;
using test::Noise;
using test::Soup;

struct Setting {
  std::uint32_t tile_size = 200;
  int threads = 2;
  bool boundary = true;
};

/// f(mesh on the scan, its projector, options with its boundary, graph)
void with_scan(const Soup& scan, const Setting& setting,
               const std::function<void(SurfaceProjector&, UntangleOptions&, TaskGraph&)>& f) {
  MemoryStore store;
  const ScanMesh mesh = tile_indexed_mesh(store, scan.positions, scan.triangles, setting.tile_size);
  oneapi::tbb::task_arena arena(setting.threads);
  arena.execute([&] {
    TaskGraph graph({setting.threads, 0});
    SurfaceProjector projector(store, mesh, {}, graph);
    const BoundaryCurve boundary(store, mesh, graph);
    UntangleOptions options;
    options.boundary = setting.boundary ? &boundary : nullptr;
    f(projector, options, graph);
  });
}

UntangleReport run(PolygonMesh& m, const Soup& scan, double leash = 0.0,
                   const Setting& setting = {}) {
  UntangleReport report;
  with_scan(scan, setting, [&](SurfaceProjector& projector, UntangleOptions& o, TaskGraph& graph) {
    o.leash = leash;
    report = untangle(m, projector, o, graph);
  });
  return report;
}

Vec3d flat(double u, double v) {
  return {u, v, 0.0};
}

/// 12 x 12 quads of the unit square; the inner vertices of the 4 x 4 in the middle are thrown
/// anywhere in there.
PolygonMesh tangled_square(std::uint64_t seed) {
  PolygonMesh m = test::grid_remesh(12, 12, flat);
  Noise noise(seed);
  for (std::uint32_t y = 4; y <= 8; ++y) {
    for (std::uint32_t x = 4; x <= 8; ++x) {
      const Vec3d d = noise.vector();
      m.positions[y * 13 + x] = Vec3d(0.5 + 0.2 * d.x(), 0.5 + 0.2 * d.y(), 0.0);
    }
  }
  return m;
}

TEST(Untangle, ScatteredVerticesFindTheirPlaces) {
  const Soup scan = test::grid_scan(30, 30, flat);
  for (std::uint64_t seed = 1; seed < 20; ++seed) {
    PolygonMesh m = tangled_square(seed);
    ASSERT_GT(measure_quality(m).bad_quads, 0U);
    const UntangleReport report = run(m, scan);
    EXPECT_EQ(report.bad_after, 0U) << seed;
    EXPECT_EQ(report.improved, report.patches);
    const MeshQuality q = measure_quality(m);
    EXPECT_EQ(q.bad_quads, 0U) << seed;
    EXPECT_GT(q.min_scaled_jacobian, 0.3) << seed;
    for (std::size_t f = 0; f < m.face_count(); ++f) {  // none looks down
      const auto v = m.face(f);
      EXPECT_GT(
          (m.positions[v[2]] - m.positions[v[0]]).cross(m.positions[v[3]] - m.positions[v[1]]).z(),
          0.0);
    }
    for (std::size_t v = 0; v < m.vertex_count(); ++v) {
      const auto row = static_cast<double>(v / 13);
      const auto column = static_cast<double>(v % 13);
      if (std::max(std::abs(row - 6), std::abs(column - 6)) > 5) {
        EXPECT_EQ(m.positions[v], Vec3d(column / 12, row / 12, 0.0));
      }
    }
  }
}

TEST(Untangle, GoodMeshesStayAsTheyAre) {
  const Soup scan = test::grid_scan(30, 30, flat);
  PolygonMesh m = test::grid_remesh(12, 12, flat);
  const auto before = m.positions;
  const UntangleReport report = run(m, scan);
  EXPECT_EQ(report.bad_before, 0U);
  EXPECT_EQ(m.positions, before);
}

TEST(Untangle, WhatCannotBeMendedStays) {
  // One quad with three corners in line, all held.
  const Soup scan = test::grid_scan(8, 8, flat);
  PolygonMesh m;
  m.positions = {{0.2, 0.2, 0}, {0.5, 0.2, 0}, {0.8, 0.2, 0}, {0.5, 0.8, 0}};
  m.vertex_flags.assign(4, kCornerVertex);
  m.add_face(std::array<std::uint32_t, 4>{0, 1, 2, 3});
  const auto before = m.positions;
  const UntangleReport report = run(m, scan);
  EXPECT_EQ(report.bad_before, 1U);
  EXPECT_EQ(report.bad_after, 1U);
  EXPECT_EQ(m.positions, before);
}

TEST(Untangle, BoundaryVerticesSlideAndLeaveOnALeashOnly) {
  const Soup scan = test::grid_scan(30, 30, flat);
  const auto folded = [] {
    PolygonMesh m = test::grid_remesh(6, 6, flat);
    std::swap(m.positions[2], m.positions[3]);  // on the side, in the wrong order
    return m;
  };
  ASSERT_GT(measure_quality(folded()).bad_quads, 0U);
  PolygonMesh m = folded();
  EXPECT_EQ(run(m, scan).bad_after, 0U);
  for (std::size_t v = 0; v < 7; ++v) {
    EXPECT_NEAR(m.positions[v].y(), 0.0, 1e-12);
  }
  // Corners that lie so that the quad between them folds.
  m = test::grid_remesh(6, 6, flat);
  m.vertex_flags.assign(m.vertex_count(), 0);
  m.vertex_flags[3] = kBoundaryVertex | kCornerVertex;
  m.vertex_flags[2] = kBoundaryVertex | kCornerVertex;
  m.positions[3] = m.positions[2] - Vec3d(0.1, 0, 0);
  PolygonMesh held = m;
  EXPECT_GT(run(held, scan).bad_after, 0U);
  EXPECT_EQ(held.positions[2], m.positions[2]);
  EXPECT_EQ(held.positions[3], m.positions[3]);
  double moved = 0.0;
  for (const double leash : {100.0, 1.0}) {
    PolygonMesh loose = m;
    EXPECT_EQ(run(loose, scan, leash).bad_after, 0U) << leash;
    const double now = (loose.positions[3] - m.positions[3]).norm();
    EXPECT_GT(now, moved);
    moved = now;
  }
}

TEST(Untangle, VerticesEndOnTheScanForAnyThreadsAndTiles) {
  const auto wave = [](double u, double v) {
    return Vec3d(u, v, 0.1 * std::sin(6 * u) * std::cos(5 * v));
  };
  const Soup scan = test::grid_scan(40, 40, wave);
  std::vector<Vec3d> first;
  for (const Setting& setting :
       {Setting{200, 1, true}, Setting{200, 3, true}, Setting{5000, 2, true}}) {
    PolygonMesh m = tangled_square(3);
    for (Vec3d& p : m.positions) {
      p = wave(p.x(), p.y());
    }
    EXPECT_EQ(run(m, scan, 0.0, setting).bad_after, 0U);
    for (const std::uint32_t v : {83U, 84U, 97U}) {
      EXPECT_LT(distance_to(scan, m.positions[v]), 1e-12);
    }
    if (first.empty()) {
      first = m.positions;
    }
    EXPECT_EQ(m.positions, first);
  }
}

TEST(MendUntilGood, FlatAndReflexCornersGetTwoFaces) {
  // A strip along a side with corners that leave no quad but a bad one between them.
  const Soup scan = test::grid_scan(30, 30, flat);
  PolygonMesh m = test::grid_remesh(6, 6, flat);
  m.vertex_flags.assign(m.vertex_count(), 0);
  for (std::uint32_t v = 0; v < m.vertex_count(); ++v) {
    const Vec3d p = m.positions[v];
    if (p.x() == 0.0 || p.y() == 0.0 || p.x() == 1.0 || p.y() == 1.0) {
      m.vertex_flags[v] = kBoundaryVertex | kCornerVertex;
    }
  }
  m.positions[0] = Vec3d(0.25, 0.25, 0.0);  // the quad at the corner is reflex there now
  ASSERT_GT(measure_quality(m).bad_quads, 0U);
  const MeshTopology before = check_topology(m);
  with_scan(scan, {}, [&](SurfaceProjector& projector, UntangleOptions& o, TaskGraph& graph) {
    PolygonMesh refused = m;
    EXPECT_GT(mend_until_good(refused, projector, o, graph,
                              [&](std::size_t faces) { return faces == m.face_count(); }),
              0U);
    EXPECT_EQ(refused.face_count(), m.face_count());
    EXPECT_EQ(mend_until_good(m, projector, o, graph, [](std::size_t) { return true; }), 0U);
  });
  const MeshQuality q = measure_quality(m);
  EXPECT_EQ(q.bad_quads, 0U);
  EXPECT_EQ(q.triangles, 0U);
  const MeshTopology after = check_topology(m);
  EXPECT_TRUE(after.clean());
  EXPECT_EQ(after.euler(), before.euler());
  EXPECT_EQ(after.boundary_loops, before.boundary_loops);
  EXPECT_LT((m.positions[0] - Vec3d(0.25, 0.25, 0.0)).norm(), 0.1);
}

}  // namespace
}  // namespace rattan
