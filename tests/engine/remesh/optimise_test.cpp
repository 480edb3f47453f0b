// SPDX-License-Identifier: MIT
#include "engine/remesh/optimise.h"

#include <cmath>

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <oneapi/tbb/task_arena.h>

#include "engine/core/memory_store.h"
#include "engine/remesh/boundary_curve.h"
#include "engine/remesh/distance.h"
#include "engine/remesh/quadric.h"
#include "engine/remesh/quality.h"
#include "engine/remesh/vertex_stars.h"
#include "tests/engine/remesh/scan_shapes.h"

namespace rattan {
namespace {

using test::distance_to;
using test::Noise;
using test::Soup;

struct Setting {
  std::uint32_t tile_size = 200;
  std::uint32_t alive = 1000;
  int threads = 2;
};

OptimiseReport run(PolygonMesh& remesh, const Soup& scan, const OptimiseOptions& options,
                   const Setting& setting = {}) {
  MemoryStore store;
  const ScanMesh mesh = tile_indexed_mesh(store, scan.positions, scan.triangles, setting.tile_size);
  OptimiseReport report;
  oneapi::tbb::task_arena arena(setting.threads);
  arena.execute([&] {
    TaskGraph graph({setting.threads, 0});
    SurfaceProjector projector(store, mesh, {setting.alive}, graph);
    report = optimise(remesh, store, mesh, projector, options, graph);
  });
  return report;
}

/// Mean deviation of corners from 90 degrees.
double mean_corner_deviation(const PolygonMesh& m) {
  double sum = 0.0;
  for (std::size_t f = 0; f < m.face_count(); ++f) {
    const auto c = m.face(f);
    for (std::size_t k = 0; k < c.size(); ++k) {
      const Vec3d a = m.positions[c[(k + 1) % c.size()]] - m.positions[c[k]];
      const Vec3d b = m.positions[c[(k + c.size() - 1) % c.size()]] - m.positions[c[k]];
      sum +=
          std::abs(std::acos(a.dot(b) / (a.norm() * b.norm())) * 180.0 / 3.14159265358979 - 90.0);
    }
  }
  return sum / static_cast<double>(m.corners.size());
}

std::size_t inverted_faces(const PolygonMesh& m) {
  const VertexStars stars(m);
  const auto normals = vertex_normals(m, stars);
  std::size_t count = 0;
  for (std::size_t f = 0; f < m.face_count(); ++f) {
    Vec3d n = Vec3d::Zero();
    for (const std::uint32_t v : m.face(f)) {
      n += normals[v];
    }
    count += corner_quality(m.positions, m.face(f), n) <= 0.0 ? 1 : 0;
  }
  return count;
}

Vec3d flat(double u, double v) {
  return {u, v, 0.0};
}

/// 12 x 12 quads of the unit square, shaken inside and along the sides; corners flagged.
PolygonMesh shaken_square(double amount) {
  constexpr std::uint32_t kCells = 12;
  PolygonMesh m = test::grid_remesh(kCells, kCells, flat);
  m.vertex_flags.assign(m.vertex_count(), 0);
  Noise noise(11);
  for (std::size_t v = 0; v < m.vertex_count(); ++v) {
    Vec3d d = noise.vector() * (amount / kCells);
    d.z() = 0.0;
    Vec3d& p = m.positions[v];
    const bool side_x = p.x() == 0.0 || p.x() == 1.0;
    const bool side_y = p.y() == 0.0 || p.y() == 1.0;
    if (side_x && side_y) {
      m.vertex_flags[v] = kBoundaryVertex | kCornerVertex;
      continue;
    }
    if (side_x || side_y) {
      m.vertex_flags[v] = kBoundaryVertex;
      d[side_x ? 0 : 1] = 0.0;
    }
    p += d;
  }
  return m;
}

TEST(Optimise, ShakenGridOnAPlaneBecomesRegular) {
  const Soup scan = test::grid_scan(37, 41, flat);
  for (const bool relocate : {false, true}) {
    PolygonMesh m = shaken_square(0.3);
    const double before = mean_corner_deviation(m);
    const auto corners = m.positions;
    OptimiseOptions options;
    options.relocate = relocate;
    options.steps = 120;
    options.pull_steps = 5;
    const OptimiseReport report = run(m, scan, options);
    EXPECT_EQ(report.inverted_after, 0U);
    EXPECT_EQ(report.steps, 125U);
    EXPECT_GT(before, 8.0);
    EXPECT_LT(mean_corner_deviation(m), 0.02);
    PolygonMesh shorter = shaken_square(0.3);
    options.steps = 40;
    run(shorter, scan, options);
    EXPECT_LT(mean_corner_deviation(shorter), 1.0);
    for (std::size_t v = 0; v < m.vertex_count(); ++v) {
      const auto row = static_cast<double>(v / 13);
      const auto column = static_cast<double>(v % 13);
      EXPECT_LT((m.positions[v] - Vec3d(column / 12, row / 12, 0.0)).norm(), 0.0005);
      EXPECT_LT(std::abs(m.positions[v].z()), 1e-12);
      if ((m.vertex_flags[v] & kCornerVertex) != 0) {
        EXPECT_EQ(m.positions[v], corners[v]);
      }
    }
  }
}

TEST(Optimise, BoundaryVerticesStayOnTheBoundary) {
  // A wavy sheet whose sides are curves in space.
  const auto wave = [](double u, double v) {
    return Vec3d(u + 0.05 * std::sin(5 * v), v + 0.07 * std::cos(4 * u), 0.1 * std::sin(6 * u * v));
  };
  const Soup scan = test::grid_scan(60, 60, wave);
  PolygonMesh m = test::grid_remesh(12, 12, wave);
  Noise noise(2);
  for (Vec3d& p : m.positions) {
    p += 0.02 * noise.vector();
  }
  m.vertex_flags.assign(m.vertex_count(), 0);
  for (const std::size_t corner : {0, 12, 13 * 12, 13 * 13 - 1}) {
    m.vertex_flags[corner] = kCornerVertex;
  }
  const auto start = m.positions;
  run(m, scan, {});
  Soup sides;
  sides.positions = scan.positions;
  for (std::uint32_t i = 0; i < 60; ++i) {
    for (const auto& [a, b] :
         std::vector<std::array<std::uint32_t, 2>>{{i, i + 1},
                                                   {60 * 61 + i, 60 * 61 + i + 1},
                                                   {i * 61, i * 61 + 61},
                                                   {i * 61 + 60, i * 61 + 121}}) {
      sides.triangles.push_back({a, b, a});
    }
  }
  const VertexStars stars(m);
  for (std::uint32_t v = 0; v < m.vertex_count(); ++v) {
    if ((m.vertex_flags[v] & kCornerVertex) != 0) {
      EXPECT_EQ(m.positions[v], start[v]);
    } else if (stars.on_boundary[v] != 0) {
      EXPECT_LT(distance_to(sides, m.positions[v]), 1e-12);
    }
  }
}

TEST(Optimise, VerticesEndOnTheSurfaceWithoutRelocation) {
  const Soup scan = test::cube_scan(24, [](const Vec3d& p) { return p.normalized(); });
  Noise noise(5);
  PolygonMesh m = test::cube_remesh(
      8, [&](const Vec3d& p) { return Vec3d((p + 0.05 * noise.vector()).normalized()); });
  const double before = mean_corner_deviation(m);
  OptimiseOptions options;
  options.relocate = false;
  const OptimiseReport report = run(m, scan, options);
  EXPECT_EQ(report.inverted_after, 0U);
  EXPECT_LT(mean_corner_deviation(m), 0.8 * before);
  for (std::uint32_t v = 0; v < m.vertex_count(); ++v) {
    EXPECT_LT(distance_to(scan, m.positions[v]), 1e-12);
    EXPECT_LT(m.scan_triangle[v], scan.triangles.size());
  }
}

TEST(Optimise, RelocationBringsFacesNearerToASphere) {
  const Soup scan = test::cube_scan(40, [](const Vec3d& p) { return p.normalized(); });
  const auto error = [&](const PolygonMesh& m) {
    MemoryStore store;
    const ScanMesh mesh = tile_indexed_mesh(store, scan.positions, scan.triangles, 1000);
    TaskGraph graph;
    SurfaceProjector projector(store, mesh, {}, graph);
    return measure_distances(m, store, mesh, projector, {}, graph).from_input.rms;
  };
  OptimiseOptions options;
  options.relocate = false;
  PolygonMesh plain = test::cube_remesh(8, [](const Vec3d& p) { return p.normalized(); });
  PolygonMesh near = plain;
  run(plain, scan, options);
  options.relocate = true;
  const OptimiseReport report = run(near, scan, options);
  EXPECT_EQ(report.relocated, near.vertex_count());
  // A sphere seen from its squares: the best constant offset alone leaves 0.3 of the error.
  EXPECT_LT(error(near), 0.5 * error(plain));
}

TEST(Optimise, RelocationPullsVerticesOntoACrease) {
  const auto roof = [](double u, double v) { return Vec3d(u, v, std::min(u, 1.0 - u)); };
  const Soup scan = test::grid_scan(64, 64, roof);
  // Columns of vertices miss the ridge at u = 0.5 by up to half an edge.
  const double shift = 0.25 / 16;
  const auto mesh = [&] {
    return test::grid_remesh(16, 16, [&](double u, double v) {
      const double x = std::clamp(u + (u > 0.0 && u < 1.0 ? shift : 0.0), 0.0, 1.0);
      return roof(x, v);
    });
  };
  const auto ridge_gap = [](const PolygonMesh& m) {
    double gap = 0.0;
    for (std::uint32_t row = 4; row <= 12; ++row) {
      const Vec3d& p = m.positions[row * 17 + 8];
      gap += (Vec3d(0.5, p.y(), 0.5) - p).norm() / 9.0;
    }
    return gap;
  };
  OptimiseOptions options;
  options.steps = options.pull_steps = 0;
  options.tangential_weight = 0.3;
  options.relocate = false;
  PolygonMesh before = mesh();
  run(before, scan, options);
  options.relocate = true;
  PolygonMesh after = mesh();
  run(after, scan, options);
  EXPECT_GT(ridge_gap(before), 0.9 * shift * std::sqrt(2.0));
  EXPECT_LT(ridge_gap(after), 0.7 * ridge_gap(before));
}

TEST(Optimise, PullingEvensEdgesAndCorners) {
  const auto wave = [](double u, double v) {
    return Vec3d(u + 0.2 * u * v, v, 0.1 * std::sin(5 * u) * std::cos(4 * v));
  };
  const Soup scan = test::grid_scan(60, 60, wave);
  const auto measured = [&](int steps, int pull_steps) {
    PolygonMesh m = test::grid_remesh(
        14, 14, [&](double u, double v) { return wave(u + 0.05 * std::sin(7 * u * v), v); });
    OptimiseOptions options;
    options.steps = steps;
    options.pull_steps = pull_steps;
    options.relocate = false;
    run(m, scan, options);
    return measure_quality(m);
  };
  const MeshQuality start = measured(0, 0);
  const MeshQuality pulled = measured(0, 40);
  EXPECT_LT(pulled.edge_length_variation, 0.8 * start.edge_length_variation);
  EXPECT_GE(pulled.mean_scaled_jacobian, start.mean_scaled_jacobian);
  const MeshQuality matched = measured(40, 0);
  const MeshQuality both = measured(40, 10);
  EXPECT_LT(1.0 - both.mean_scaled_jacobian, 1.0 - matched.mean_scaled_jacobian);
}

TEST(Optimise, NoFaceIsInvertedThatWasNot) {
  const Soup scan = test::cube_scan(30, [](const Vec3d& p) {
    return Vec3d(p.x(), 0.15 * p.y(), (1.0 + 0.3 * std::sin(4 * p.x())) * p.z());
  });
  Noise noise(9);
  for (int trial = 0; trial < 5; ++trial) {
    PolygonMesh m = test::cube_remesh(7, [&](const Vec3d& p) {
      const Vec3d q = p + 0.06 * noise.vector();
      return Vec3d(q.x(), 0.15 * q.y(), (1.0 + 0.3 * std::sin(4 * q.x())) * q.z());
    });
    const std::size_t before = inverted_faces(m);
    const OptimiseReport report = run(m, scan, {});
    EXPECT_LE(report.inverted_after, before);
    EXPECT_EQ(report.inverted_after, inverted_faces(m));
  }
}

TEST(Optimise, UntanglesWhatALocalStepCan) {
  const Soup scan = test::grid_scan(30, 30, flat);
  PolygonMesh m = shaken_square(0.0);
  // Two vertices swapped far across their neighbours; no smoothing to help.
  std::swap(m.positions[13 * 5 + 5], m.positions[13 * 5 + 6]);
  m.positions[13 * 9 + 9] += Vec3d(1.4 / 12, 0.2 / 12, 0.0);
  OptimiseOptions options;
  options.steps = 0;
  options.relocate = false;
  const OptimiseReport report = run(m, scan, options);
  EXPECT_GT(report.inverted_before, 3U);
  EXPECT_EQ(report.inverted_after, 0U);
}

TEST(Optimise, TilesScenesAndThreadsChangeNothing) {
  const auto bumps = [](const Vec3d& p) {
    return Vec3d(p.normalized() * (1.0 + 0.1 * std::sin(5 * p.x()) * std::cos(4 * p.y())));
  };
  const Soup scan = test::cube_scan(30, bumps);
  Noise noise(4);
  PolygonMesh start = test::cube_remesh(
      12, [&](const Vec3d& p) { return bumps(Vec3d(p + 0.03 * noise.vector())); });
  PolygonMesh reference = start;
  run(reference, scan, {}, {100000, 1000, 1});
  for (const Setting& s : {Setting{100000, 0, 2}, Setting{300, 1000, 2}, Setting{77, 3, 1}}) {
    PolygonMesh m = start;
    run(m, scan, {}, s);
    for (std::size_t v = 0; v < m.vertex_count(); ++v) {
      ASSERT_EQ(m.positions[v], reference.positions[v]);
      ASSERT_EQ(m.scan_triangle[v], reference.scan_triangle[v]);
    }
  }
}

TEST(Quadric, SharesTheScanOutAndFindsThePlane) {
  const Soup scan = test::grid_scan(40, 40, [](double u, double v) { return Vec3d(u, v, 0.125); });
  MemoryStore store;
  const ScanMesh mesh = tile_indexed_mesh(store, scan.positions, scan.triangles, 123);
  TaskGraph graph;
  const PolygonMesh m = test::grid_remesh(10, 10, flat);
  const std::vector<Vec3d> up(m.vertex_count(), Vec3d::UnitZ());
  const auto q = gather_quadrics(store, mesh, m.positions, up, 0.2, graph);
  double area = 0.0;
  for (std::size_t v = 0; v < q.size(); ++v) {
    area += q[v].area;
    const Vec3d d = quadric_displacement(q[v], up[v], 0.3, 0.0);
    EXPECT_LT((d - Vec3d(0, 0, 0.125)).norm(), 1e-12);
  }
  EXPECT_NEAR(area, 1.0, 1e-6);
  // An interior vertex is nearest to one cell's worth.
  EXPECT_NEAR(q[11 * 5 + 5].area, 0.01, 0.002);
  // Seen from behind or out of reach, nothing counts.
  const std::vector<Vec3d> down(m.vertex_count(), -Vec3d::UnitZ());
  for (const auto& none : {gather_quadrics(store, mesh, m.positions, down, 0.2, graph),
                           gather_quadrics(store, mesh, m.positions, up, 0.1, graph)}) {
    for (const VertexQuadric& v : none) {
      EXPECT_EQ(v.area, 0.0);
      EXPECT_EQ(quadric_displacement(v, Vec3d::UnitZ(), 0.3, 0.01), Vec3d::Zero());
    }
  }
}

TEST(BoundaryCurve, FindsLoopsAndNearestPoints) {
  // A square with a square hole: two loops.
  Soup scan = test::grid_scan(9, 9, flat);
  std::erase_if(scan.triangles, [&](const auto& t) {
    const Vec3d c = (scan.positions[t[0]] + scan.positions[t[1]] + scan.positions[t[2]]) / 3.0;
    return c.x() > 3.0 / 9 && c.x() < 6.0 / 9 && c.y() > 3.0 / 9 && c.y() < 6.0 / 9;
  });
  for (const std::uint32_t tile_size : {7U, 1000U}) {
    MemoryStore store;
    const ScanMesh mesh = tile_indexed_mesh(store, scan.positions, scan.triangles, tile_size);
    TaskGraph graph;
    const BoundaryCurve curve(store, mesh, graph);
    EXPECT_EQ(curve.segment_count(), 48U);
    EXPECT_EQ(curve.loop_count(), 2U);
    const auto inner = curve.closest({0.3, 0.5, 0.1});
    EXPECT_EQ(inner.loop, 1U);
    EXPECT_NEAR(inner.point.x(), 1.0 / 3, 1e-7);
    const auto outer = curve.closest_on_loop({0.3, 0.5, 0.1}, 0);
    EXPECT_EQ(outer.loop, 0U);
    EXPECT_EQ(outer.point.x(), 0.0);
  }
  const Soup closed = test::cube_scan(3, [](const Vec3d& p) { return p; });
  MemoryStore store;
  const ScanMesh mesh = tile_indexed_mesh(store, closed.positions, closed.triangles, 10);
  TaskGraph graph;
  const BoundaryCurve none(store, mesh, graph);
  EXPECT_TRUE(none.empty());
  EXPECT_FALSE(none.closest(Vec3d::Zero()).found);
}

}  // namespace
}  // namespace rattan
