// SPDX-License-Identifier: MIT
#include "engine/remesh/distance.h"

#include <cmath>

#include <gtest/gtest.h>

#include "engine/core/memory_store.h"
#include "engine/remesh/distance_summary.h"
#include "engine/remesh/surface_samples.h"
#include "tests/engine/remesh/scan_shapes.h"

namespace rattan {
namespace {

DistanceReport measure(const PolygonMesh& remesh, const test::Soup& scan, std::uint32_t tile_size,
                       std::uint32_t stride = 1, std::uint64_t samples = 0) {
  MemoryStore store;
  const ScanMesh mesh = tile_indexed_mesh(store, scan.positions, scan.triangles, tile_size);
  TaskGraph graph;
  SurfaceProjector projector(store, mesh, {3}, graph);
  return measure_distances(remesh, store, mesh, projector, {stride, samples}, graph);
}

TEST(Distance, OffsetPlanes) {
  const test::Soup scan =
      test::grid_scan(32, 32, [](double u, double v) { return Vec3d(u, v, 0.0); });
  const PolygonMesh inner = test::grid_remesh(
      4, 4, [](double u, double v) { return Vec3d(0.25 + 0.5 * u, 0.25 + 0.5 * v, 0.25); });
  const DistanceReport r = measure(inner, scan, 100);
  EXPECT_DOUBLE_EQ(r.to_input.max, 0.25);
  EXPECT_DOUBLE_EQ(r.to_input.rms, 0.25);
  EXPECT_DOUBLE_EQ(r.to_input.mean, 0.25);
  EXPECT_DOUBLE_EQ(r.from_input.max, std::sqrt(3.0) * 0.25);
  EXPECT_GT(r.from_input.rms, r.from_input.mean);
  EXPECT_GT(r.from_input.mean, 0.25);
  EXPECT_DOUBLE_EQ(r.diagonal, std::sqrt(2.0));
  EXPECT_EQ(r.from_input.points, 33U * 33U);
  EXPECT_EQ(r.scan_share, 1.0);
}

TEST(Distance, ConcentricSpheres) {
  const auto sphere = [](double radius) {
    return [radius](const Vec3d& p) { return Vec3d(p.normalized() * radius); };
  };
  const test::Soup scan = test::cube_scan(40, sphere(1.0));
  const DistanceReport r = measure(test::cube_remesh(40, sphere(1.1)), scan, 500);
  EXPECT_NEAR(r.from_input.rms, 0.1, 0.001);
  EXPECT_NEAR(r.from_input.max, 0.1, 0.001);
  EXPECT_NEAR(r.to_input.mean, 0.1, 0.001);
  EXPECT_NEAR(r.to_input.max, 0.1, 0.001);
  const DistanceReport same = measure(test::cube_remesh(40, sphere(1.0)), scan, 500);
  EXPECT_LT(same.from_input.max, 1e-7);
  EXPECT_LT(same.to_input.max, 0.002);
}

TEST(Distance, TilesChangeNothingAndStridesSample) {
  test::Noise noise(3);
  const test::Soup scan =
      test::grid_scan(40, 30, [&](double u, double v) { return Vec3d(u, v, 0.05 * noise()); });
  const PolygonMesh remesh =
      test::grid_remesh(7, 6, [](double u, double v) { return Vec3d(u, v, 0.1 * u); });
  const DistanceReport one = measure(remesh, scan, 100000);
  const DistanceReport many = measure(remesh, scan, 37);
  EXPECT_EQ(one.from_input.rms, many.from_input.rms);
  EXPECT_EQ(one.from_input.mean, many.from_input.mean);
  EXPECT_EQ(one.to_input.rms, many.to_input.rms);
  EXPECT_EQ(one.to_input.max, many.to_input.max);
  const DistanceReport sampled = measure(remesh, scan, 37, 5);
  EXPECT_EQ(sampled.from_input.points, (41U * 31U + 4U) / 5U);
  EXPECT_NEAR(sampled.scan_share, 0.2, 0.001);
  EXPECT_LE(sampled.from_input.max, one.from_input.max);
  EXPECT_NEAR(sampled.from_input.rms, one.from_input.rms, 0.15 * one.from_input.rms);
  EXPECT_EQ(sampled.from_input.rms, measure(remesh, scan, 100000, 5).from_input.rms);
}

TEST(Distance, SamplesWeighByAreaHoweverVerticesLie) {
  // Columns crowd at u = 0, where the slanted plane is near.
  const test::Soup scan =
      test::grid_scan(60, 4, [](double u, double v) { return Vec3d(u * u * u, v, 0.0); });
  const PolygonMesh slanted =
      test::grid_remesh(1, 1, [](double u, double v) { return Vec3d(u, v, 0.1 * u); });
  const double steep = 0.1 / std::sqrt(1.01);  // distance at u = 1
  const DistanceReport r = measure(slanted, scan, 50, 1, 50000);
  EXPECT_NEAR(r.from_input.mean, steep / 2, 2e-4);
  EXPECT_NEAR(r.from_input.rms, steep / std::sqrt(3.0), 2e-4);
  EXPECT_NEAR(r.from_input.p99, 0.99 * steep, 2e-4);
  EXPECT_NEAR(r.from_input.max, steep, 1e-7);
  EXPECT_NEAR(static_cast<double>(r.from_input.samples), 50000.0, 500.0);
  EXPECT_EQ(r.from_input.points, r.from_input.samples + 61 * 5);
  // Straight down to the scan.
  EXPECT_NEAR(r.to_input.mean, 0.05, 2e-4);
  EXPECT_NEAR(r.to_input.p99, 0.099, 2e-4);
  EXPECT_DOUBLE_EQ(r.to_input.max, 0.1);
  EXPECT_LT(measure(slanted, scan, 50).from_input.mean, 0.3 * steep);
}

TEST(Distance, SpheresOfNearlyTheSameRadius) {
  const auto sphere = [](double radius) {
    return [radius](const Vec3d& p) { return Vec3d(p.normalized() * radius); };
  };
  const double e = 0.01;
  const test::Soup scan = test::cube_scan(60, sphere(1.0));
  const DistanceReport r = measure(test::cube_remesh(60, sphere(1.0 + e)), scan, 3000, 1, 20000);
  // Flat faces lie inside their sphere by up to an eighth of the square of their longest side.
  const double sag = std::pow(2.0 / 60 * std::sqrt(2.0), 2) / 8;
  EXPECT_NEAR(r.from_input.mean, e, sag);
  EXPECT_NEAR(r.to_input.mean, e, sag);
  EXPECT_NEAR(r.from_input.p99, e, sag + e / 1024);
  EXPECT_NEAR(r.to_input.max, e, sag);
}

TEST(Distance, AQuadIsItsShorterDiagonal) {
  // A kite bent along its shorter diagonal lies on the two triangles of that diagonal.
  test::Soup scan;
  scan.positions = {Vec3d(-2, 0, 0.5), Vec3d(0, -1, 0), Vec3d(2, 0, 0.5), Vec3d(0, 1, 0)};
  scan.triangles = {{0, 1, 3}, {1, 2, 3}};
  for (std::uint32_t turn = 0; turn < 4; ++turn) {
    PolygonMesh kite;
    kite.positions = scan.positions;
    for (std::uint32_t k = 0; k < 4; ++k) {
      kite.corners.push_back((turn + k) % 4);
    }
    kite.face_begin.push_back(4);
    const DistanceReport r = measure(kite, scan, 10, 1, 1000);
    EXPECT_NEAR(r.from_input.max, 0.0, 1e-12);
    // All but the middle of the face, which is no point of those triangles.
    EXPECT_NEAR(r.to_input.p99, 0.0, 1e-12);
  }
}

TEST(Distance, SamplesDependOnNeitherTilesNorThreads) {
  test::Noise noise(5);
  const test::Soup scan =
      test::grid_scan(30, 30, [&](double u, double v) { return Vec3d(u, v, 0.05 * noise()); });
  const PolygonMesh remesh =
      test::grid_remesh(5, 5, [](double u, double v) { return Vec3d(u, v, 0.1 * u); });
  const DistanceReport one = measure(remesh, scan, 100000, 1, 3000);
  const DistanceReport many = measure(remesh, scan, 100, 1, 3000);
  EXPECT_EQ(one.from_input.samples, many.from_input.samples);
  EXPECT_EQ(one.from_input.p99, many.from_input.p99);
  EXPECT_EQ(one.from_input.max, many.from_input.max);
  EXPECT_EQ(one.to_input.rms, many.to_input.rms);
}

TEST(DistanceSummary, OfKnownNumbers) {
  DistanceSummary s;
  EXPECT_EQ(s.quantile(0.99), 0.0);
  EXPECT_EQ(s.mean(), 0.0);
  for (int i = 1000; i >= 1; --i) {
    s.add(1e-6 * i * i);
  }
  EXPECT_NEAR(s.mean(), 0.5005, 1e-12);
  EXPECT_NEAR(s.rms(), std::sqrt(1001.0 * 2001.0 / 6.0) * 1e-3, 1e-12);
  EXPECT_NEAR(s.max(), 1.0, 1e-15);
  for (const double share : {0.001, 0.25, 0.5, 0.99, 1.0}) {
    EXPECT_GE(s.quantile(share), share * (1 - 1e-12));
    EXPECT_LE(s.quantile(share), share * (1 + 1.0 / 1024));
  }
  DistanceSummary extremes;
  extremes.add(0.0);
  extremes.add(1e300);
  EXPECT_EQ(extremes.quantile(0.5), 0.0);
  EXPECT_EQ(extremes.quantile(1.0), extremes.max());
}

TEST(SurfaceSamples, AreInsideAndEvenlySpread) {
  const Vec3d a(1, 2, 3), b(4, 2, 3), c(1, 4, 3);  // area 3
  std::vector<Vec3d> points;
  sample_triangle(7, a, b, c, 3000.0, points);
  EXPECT_NEAR(static_cast<double>(points.size()), 9000.0, 1.0);
  Vec3d middle = Vec3d::Zero();
  std::size_t lower_quarter = 0;
  for (const Vec3d& p : points) {
    const double u = (p.x() - 1) / 3, v = (p.y() - 2) / 2;
    EXPECT_TRUE(u >= 0 && v >= 0 && u + v <= 1 + 1e-12 && p.z() == 3);
    middle += p / static_cast<double>(points.size());
    lower_quarter += u + v < 0.5;
  }
  EXPECT_LT((middle - (a + b + c) / 3).norm(), 0.005);
  EXPECT_NEAR(static_cast<double>(lower_quarter), 0.25 * 9000, 50);
}

TEST(SurfaceSamples, CountsAreFairForTrianglesTooSmallForOne) {
  std::vector<Vec3d> points;
  for (std::uint64_t t = 0; t < 20000; ++t) {
    sample_triangle(t, Vec3d(0, 0, 0), Vec3d(1, 0, 0), Vec3d(0, 0.5, 0), 1.0, points);
  }
  EXPECT_NEAR(static_cast<double>(points.size()), 5000.0, 250.0);
  const std::size_t before = points.size();
  sample_triangle(1, Vec3d(0, 0, 0), Vec3d(1, 0, 0), Vec3d(2, 0, 0), 1e6, points);
  EXPECT_EQ(points.size(), before);  // no area
  EXPECT_EQ(sample_density(10, 0.0), 0.0);
  EXPECT_EQ(sample_density(10, 5.0), 2.0);
}

}  // namespace
}  // namespace rattan
