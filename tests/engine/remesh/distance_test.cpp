// SPDX-License-Identifier: MIT
#include "engine/remesh/distance.h"

#include <cmath>

#include <gtest/gtest.h>

#include "engine/core/memory_store.h"
#include "tests/engine/remesh/scan_shapes.h"

namespace rattan {
namespace {

DistanceReport measure(const PolygonMesh& remesh, const test::Soup& scan, std::uint32_t tile_size,
                       std::uint32_t stride = 1) {
  MemoryStore store;
  const ScanMesh mesh = tile_indexed_mesh(store, scan.positions, scan.triangles, tile_size);
  TaskGraph graph;
  SurfaceProjector projector(store, mesh, {3}, graph);
  return measure_distances(remesh, store, mesh, projector, {stride}, graph);
}

TEST(Distance, OffsetPlanes) {
  const test::Soup scan =
      test::grid_scan(32, 32, [](double u, double v) { return Vec3d(u, v, 0.0); });
  const PolygonMesh inner = test::grid_remesh(
      4, 4, [](double u, double v) { return Vec3d(0.25 + 0.5 * u, 0.25 + 0.5 * v, 0.25); });
  const DistanceReport r = measure(inner, scan, 100);
  EXPECT_DOUBLE_EQ(r.to_input_max, 0.25);
  EXPECT_DOUBLE_EQ(r.to_input_rms, 0.25);
  EXPECT_DOUBLE_EQ(r.to_input_mean, 0.25);
  EXPECT_DOUBLE_EQ(r.from_input_max, std::sqrt(3.0) * 0.25);
  EXPECT_GT(r.from_input_rms, r.from_input_mean);
  EXPECT_GT(r.from_input_mean, 0.25);
  EXPECT_DOUBLE_EQ(r.diagonal, std::sqrt(2.0));
  EXPECT_EQ(r.scan_samples, 33U * 33U);
  EXPECT_EQ(r.scan_share, 1.0);
}

TEST(Distance, ConcentricSpheres) {
  const auto sphere = [](double radius) {
    return [radius](const Vec3d& p) { return Vec3d(p.normalized() * radius); };
  };
  const test::Soup scan = test::cube_scan(40, sphere(1.0));
  const DistanceReport r = measure(test::cube_remesh(40, sphere(1.1)), scan, 500);
  EXPECT_NEAR(r.from_input_rms, 0.1, 0.001);
  EXPECT_NEAR(r.from_input_max, 0.1, 0.001);
  EXPECT_NEAR(r.to_input_mean, 0.1, 0.001);
  EXPECT_NEAR(r.to_input_max, 0.1, 0.001);
  const DistanceReport same = measure(test::cube_remesh(40, sphere(1.0)), scan, 500);
  EXPECT_LT(same.from_input_max, 1e-7);
  EXPECT_LT(same.to_input_max, 0.002);
}

TEST(Distance, TilesChangeNothingAndStridesSample) {
  test::Noise noise(3);
  const test::Soup scan =
      test::grid_scan(40, 30, [&](double u, double v) { return Vec3d(u, v, 0.05 * noise()); });
  const PolygonMesh remesh =
      test::grid_remesh(7, 6, [](double u, double v) { return Vec3d(u, v, 0.1 * u); });
  const DistanceReport one = measure(remesh, scan, 100000);
  const DistanceReport many = measure(remesh, scan, 37);
  EXPECT_EQ(one.from_input_rms, many.from_input_rms);
  EXPECT_EQ(one.from_input_mean, many.from_input_mean);
  EXPECT_EQ(one.to_input_rms, many.to_input_rms);
  EXPECT_EQ(one.to_input_max, many.to_input_max);
  const DistanceReport sampled = measure(remesh, scan, 37, 5);
  EXPECT_EQ(sampled.scan_samples, (41U * 31U + 4U) / 5U);
  EXPECT_NEAR(sampled.scan_share, 0.2, 0.001);
  EXPECT_LE(sampled.from_input_max, one.from_input_max);
  EXPECT_NEAR(sampled.from_input_rms, one.from_input_rms, 0.15 * one.from_input_rms);
  EXPECT_EQ(sampled.from_input_rms, measure(remesh, scan, 100000, 5).from_input_rms);
}

}  // namespace
}  // namespace rattan
