// SPDX-License-Identifier: MIT
#include "engine/remesh/quality.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/engine/remesh/shapes.h"

namespace rattan {
namespace {

using namespace test;

TEST(ScaledJacobian, OfParallelogramsIsTheSineOfTheirAngle) {
  for (const double angle : {0.1, 0.5, 1.0, 1.5, 2.5}) {
    const Vec3d b(2, 0, 0), d(3 * std::cos(angle), 3 * std::sin(angle), 0);
    EXPECT_NEAR(scaled_jacobian(Vec3d::Zero(), b, b + d, d), std::sin(angle), 1e-14);
  }
}

TEST(ScaledJacobian, IsNotPositiveForReflexFlatAndDegenerateCorners) {
  const Vec3d a(0, 0, 0), b(2, 0, 0), d(0, 2, 0);
  EXPECT_LT(scaled_jacobian(a, b, Vec3d(0.5, 0.5, 0), d), 0);
  EXPECT_NEAR(scaled_jacobian(a, b, Vec3d(1, 1, 0), d), 0, 1e-14);
  EXPECT_EQ(scaled_jacobian(a, b, b, d), 0);
  EXPECT_EQ(scaled_jacobian(a, a, a, a), 0);
  EXPECT_LE(scaled_jacobian(a, Vec3d(1, 1, 0), b, d), 0);  // crossed
}

TEST(MeasureQuality, OfAGridIsPerfect) {
  const MeshQuality q = measure_quality(grid(4, 3));
  EXPECT_EQ(q.quads, 12U);
  EXPECT_EQ(q.triangles, 0U);
  EXPECT_EQ(q.quad_share, 1.0);
  EXPECT_EQ(q.interior_vertices, 6U);
  EXPECT_EQ(q.irregular_vertices, 0U);
  EXPECT_NEAR(q.mean_scaled_jacobian, 1, 1e-14);
  EXPECT_NEAR(q.min_scaled_jacobian, 1, 1e-14);
  EXPECT_NEAR(q.mean_corner_deviation, 0, 1e-12);
  EXPECT_NEAR(q.mean_edge_length, 1, 1e-14);
  EXPECT_NEAR(q.edge_length_variation, 0, 1e-7);
  EXPECT_EQ(q.bad_quads, 0U);
  EXPECT_NEAR(q.stretch, 1, 1e-14);
  EXPECT_NEAR(q.shear, 0, 1e-14);
}

TEST(MeasureQuality, OfAStretchedGridAndACube) {
  PolygonMesh wide = grid(2, 2);
  for (Vec3d& p : wide.positions) {
    p.x() *= 3;
  }
  const MeshQuality q = measure_quality(wide);
  EXPECT_NEAR(q.mean_edge_length, 2, 1e-14);
  EXPECT_NEAR(q.edge_length_variation, 0.5, 1e-12);
  EXPECT_NEAR(q.stretch, std::sqrt(5.0 / 3.0), 1e-14);  // (9 + 1) / 2 over an area of 3
  EXPECT_NEAR(q.shear, 0, 1e-14);
  const MeshQuality cube = measure_quality(slab(0));
  EXPECT_EQ(cube.irregular_vertices, 8U);
  PolygonMesh sheared = grid(1, 1);
  sheared.positions[2].x() += 1;
  sheared.positions[3].x() += 1;
  EXPECT_NEAR(measure_quality(sheared).mean_corner_deviation, 45, 1e-12);
  EXPECT_NEAR(measure_quality(sheared).mean_scaled_jacobian, std::sqrt(0.5), 1e-14);
  EXPECT_NEAR(measure_quality(sheared).shear, std::sqrt(0.5), 1e-14);
  EXPECT_NEAR(measure_quality(sheared).stretch, std::sqrt(1.5), 1e-14);
}

}  // namespace
}  // namespace rattan
