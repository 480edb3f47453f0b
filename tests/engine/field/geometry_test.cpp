// SPDX-License-Identifier: MIT
#include <cmath>

#include <gtest/gtest.h>

#include "engine/field/curvature.h"
#include "engine/field/low_pass.h"
#include "engine/field/smoothing.h"
#include "engine/field/tangent_frame.h"
#include "tests/engine/mesh/test_surfaces.h"

namespace rattan {
namespace {

using testing::bytes_of;
using testing::Surface;
using testing::TiledScan;

struct Prepared {
  double area = 0.0;
};

Prepared prepare(TiledScan& scan, double radius, int rounds) {
  build_vertex_graph(scan.store, scan.mesh, scan.tasks);
  LowPassOptions low_pass;
  low_pass.radius = radius;
  low_pass_positions(scan.store, scan.mesh, low_pass, scan.tasks);
  GeometryOptions options;
  options.curvature_rounds = rounds;
  return {prepare_surface(scan.store, scan.mesh, options, scan.tasks)};
}

TEST(TangentFrame, IsOrthonormalAndTransportIsExactlyAntisymmetric) {
  const Surface s = testing::sphere(6, 1.0);
  for (std::size_t i = 0; i + 1 < s.positions.size(); ++i) {
    const Vec3d n = s.positions[i];
    const TangentFrame f = tangent_frame(n);
    EXPECT_NEAR((f.x.cross(f.y) - n).norm(), 0.0, 1e-14);
    const TangentFrame g = tangent_frame(s.positions[i + 1]);
    const Complexd there = transport(f, g);
    const Complexd back = transport(g, f);
    EXPECT_EQ(there, std::conj(back));
    // The shortest rotation from one normal to the other carries g.x to an angle of arg(there).
    const Eigen::Quaterniond q =
        Eigen::Quaterniond::FromTwoVectors(s.positions[i + 1], s.positions[i]);
    const Vec3d carried = q * g.x;
    EXPECT_NEAR(carried.dot(f.x), there.real(), 1e-12);
    EXPECT_NEAR(carried.dot(f.y), there.imag(), 1e-12);
  }
}

TEST(TangentFrame, RootUndoesPower) {
  for (int k = 0; k < 64; ++k) {
    const double a = -M_PI + (k + 0.5) * M_PI / 32.0;
    for (const int n : {1, 2, 4}) {
      const Complexd z(std::cos(a), std::sin(a));
      const Complexd root = symmetry_root(z, n);
      EXPECT_NEAR(std::arg(root), a / n, 1e-14);
      EXPECT_NEAR(std::abs(symmetry_power(root, n) - z), 0.0, 1e-14);
    }
  }
  EXPECT_NEAR(std::abs(symmetry_power(symmetry_root({-1.0, 0.0}, 4), 4) - Complexd(-1.0, 0.0)), 0.0,
              1e-14);
}

TEST(Curvature, CylinderHasItsPrincipalDirections) {
  for (const double sign : {1.0, -1.0}) {
    const double radius = 3.0;
    Surface s = testing::cylinder(60, 20, radius, 6.0);
    if (sign < 0.0) {
      for (auto& t : s.triangles) {
        std::swap(t[1], t[2]);
      }
    }
    TiledScan scan(s, 200);
    prepare(scan, 0.0, 3);
    const auto normals = scan.all(fields::kNormal);
    const auto measures = scan.all(fields::kCurvature);
    for (std::size_t i = 60 * 5; i < 60 * 15; ++i) {
      const Vec3d n = normals[i].cast<double>();
      const TangentFrame f = tangent_frame(n);
      const PrincipalDirections p = principal_directions(measures[i], f.x, f.y, 1e-4);
      EXPECT_NEAR(p.k1, sign / radius, 0.01 / radius);
      EXPECT_NEAR(p.k2, 0.0, 0.03 / radius);
      EXPECT_NEAR(p.fidelity, 0.5, 0.03);
      const Complexd z = symmetry_root(p.doubled, 2);
      const Vec3d k = z.real() * f.x + z.imag() * f.y;
      EXPECT_LT(std::abs(k.z()), 0.02);  // around, not along
    }
  }
}

TEST(Curvature, TorusWithinTolerance) {
  const double big = 3.0;
  const double small = 1.0;
  TiledScan scan(testing::torus(120, 48, big, small), 1000);
  const Prepared done = prepare(scan, 0.0, 2);
  EXPECT_NEAR(done.area, 4.0 * M_PI * M_PI * big * small, 0.01 * done.area);
  const auto normals = scan.all(fields::kNormal);
  const auto measures = scan.all(fields::kCurvature);
  double worst1 = 0.0;
  double worst2 = 0.0;
  double worst_turn = 0.0;
  double worst_normal = 0.0;
  for (std::size_t j = 0; j < 48; ++j) {
    for (std::size_t i = 0; i < 120; ++i) {
      const double a = 2.0 * M_PI * static_cast<double>(i) / 120.0;
      const double b = 2.0 * M_PI * static_cast<double>(j) / 48.0;
      const Vec3d n = normals[j * 120 + i].cast<double>();
      const Vec3d exact(std::cos(b) * std::cos(a), std::cos(b) * std::sin(a), std::sin(b));
      worst_normal = std::max(worst_normal, (n - exact).norm());
      const TangentFrame f = tangent_frame(n);
      const PrincipalDirections p = principal_directions(measures[j * 120 + i], f.x, f.y, 1e-6);
      worst1 = std::max(worst1, std::abs(p.k1 - 1.0 / small));
      worst2 = std::max(worst2, std::abs(p.k2 - std::cos(b) / (big + small * std::cos(b))));
      const Complexd z = symmetry_root(p.doubled, 2);
      const Vec3d k = z.real() * f.x + z.imag() * f.y;
      worst_turn = std::max(worst_turn, std::abs(k.dot(Vec3d(-std::sin(a), std::cos(a), 0.0))));
    }
  }
  EXPECT_LT(worst_normal, 0.02);
  EXPECT_LT(worst1, 0.05);
  EXPECT_LT(worst2, 0.05);
  EXPECT_LT(worst_turn, 0.03);
}

TEST(Curvature, PlanesGetNoSay) {
  TiledScan scan(testing::plane(10, 10, 1.0, 1.0), 40);
  prepare(scan, 0.0, 3);
  for (const CurvatureMeasure& m : scan.all(fields::kCurvature)) {
    const PrincipalDirections p =
        principal_directions(m, Vec3d::UnitX(), Vec3d::UnitY(), 1.0 / (1000.0 * 0.1));
    EXPECT_LT(p.fidelity, 1e-6);
  }
}

TEST(LowPass, RemovesNoiseAndKeepsTheShape) {
  const double big = 3.0;
  const double small = 1.0;
  const Surface clean = testing::torus(120, 48, big, small);
  const Surface noisy = testing::jittered(clean, 0.05);
  TiledScan scan(noisy, 700);
  build_vertex_graph(scan.store, scan.mesh, scan.tasks);
  LowPassOptions options;
  options.radius = 2.0 * scan.mesh.mean_edge_length;
  low_pass_positions(scan.store, scan.mesh, options, scan.tasks);
  const auto p = scan.all(fields::kSmoothPosition);
  double before = 0.0;
  double after = 0.0;
  double mean = 0.0;
  const auto off = [&](const Vec3d& x) {
    const double rho = std::sqrt(x.x() * x.x() + x.y() * x.y()) - big;
    return std::sqrt(rho * rho + x.z() * x.z()) - small;
  };
  for (std::size_t i = 0; i < p.size(); ++i) {
    const double o = off(p[i].cast<double>());
    before += off(noisy.positions[i]) * off(noisy.positions[i]);
    after += o * o;
    mean += o;
  }
  const double n = static_cast<double>(p.size());
  EXPECT_LT(std::sqrt(after / n), 0.45 * std::sqrt(before / n));
  EXPECT_LT(std::abs(mean / n), 0.01 * small);  // no shrinking
}

TEST(LowPass, KeepsAPlaneFlatItsBoundaryOnItsCurveAndThinPartsAlive) {
  {
    TiledScan scan(testing::jittered(testing::plane(16, 16, 1.0, 1.0), 0.0), 50);
    build_vertex_graph(scan.store, scan.mesh, scan.tasks);
    LowPassOptions options;
    options.radius = 0.15;
    low_pass_positions(scan.store, scan.mesh, options, scan.tasks);
    for (const Vec3f& p : scan.all(fields::kSmoothPosition)) {
      EXPECT_EQ(p.z(), 0.0F);
      EXPECT_GE(p.x(), -0.01F);
      EXPECT_LE(p.x(), 1.01F);
    }
  }
  {
    // A tube as thin as the capped filter may meet: six edges around.
    TiledScan scan(testing::cylinder(6, 100, 0.1, 10.0), 100);
    build_vertex_graph(scan.store, scan.mesh, scan.tasks);
    LowPassOptions options;
    options.radius = capped_low_pass_radius(scan.mesh, 5.0);
    EXPECT_LT(options.radius, 0.5);
    low_pass_positions(scan.store, scan.mesh, options, scan.tasks);
    const auto p = scan.all(fields::kSmoothPosition);
    for (std::size_t i = 6 * 20; i < 6 * 80; ++i) {
      EXPECT_GT(p[i].head<2>().norm(), 0.03F);
    }
  }
}

TEST(LowPass, DegenerateTrianglesStayFinite) {
  Surface s = testing::plane(8, 8, 1.0, 1.0);
  s.positions[20] = s.positions[21];
  s.positions[40] = s.positions[41] = s.positions[49] = s.positions[50] = s.positions[39];
  for (Vec3d& p : s.positions) {
    p *= 1e-12;
  }
  TiledScan scan(s, 30);
  prepare(scan, 1e-12, 3);
  SmoothingOptions smoothing;
  smoothing.fitting_length = 1e-12;
  assemble_smoothing(scan.store, scan.mesh, smoothing, scan.tasks);
  for (const Vec3f& p : scan.all(fields::kSmoothPosition)) {
    EXPECT_TRUE(p.allFinite());
  }
  for (const Vec3f& n : scan.all(fields::kNormal)) {
    EXPECT_NEAR(n.norm(), 1.0F, 1e-5F);
  }
  for (const CurvatureMeasure& m : scan.all(fields::kCurvature)) {
    for (const float x : m.m) {
      EXPECT_TRUE(std::isfinite(x));
    }
  }
  for (const ComplexBlock::Coefficient& c : scan.all(fields::kSmoothingSystem.coefficient)) {
    EXPECT_TRUE(std::isfinite(c.c.real()) && std::isfinite(c.c.imag()));
  }
}

TEST(Geometry, TileLocalPartsAreTheSameForAllTileSizes) {
  const Surface s = testing::jittered(testing::torus(40, 25, 2.0, 0.7), 0.03);
  std::string first;
  for (const std::uint32_t tile : {19U, 128U, 4000U}) {
    TiledScan scan(s, tile);
    prepare(scan, 0.0, 3);
    SmoothingOptions smoothing;
    smoothing.fitting_length = 0.5;
    assemble_smoothing(scan.store, scan.mesh, smoothing, scan.tasks);
    const std::string all =
        bytes_of(scan.all(fields::kEdgeWeight)) + bytes_of(scan.all(fields::kDiagonal)) +
        bytes_of(scan.all(fields::kNormal)) + bytes_of(scan.all(fields::kVertexArea)) +
        bytes_of(scan.all(fields::kCurvature)) +
        bytes_of(scan.all(fields::kSmoothingSystem.coefficient)) +
        bytes_of(scan.all(fields::kSmoothingSystem.rhs));
    if (first.empty()) {
      first = all;
    } else {
      EXPECT_TRUE(first == all) << "tile size " << tile;
    }
  }
}

TEST(Smoothing, CoefficientsAreExactAdjointsAndFitsFollowTheBoundary) {
  TiledScan scan(testing::jittered(testing::plane(12, 9, 12.0, 9.0), 0.0), 25);
  prepare(scan, 0.0, 2);
  SmoothingOptions options;
  options.fitting_length = 3.0;
  options.floor_curvature = 1e-3;
  const double fit = assemble_smoothing(scan.store, scan.mesh, options, scan.tasks);
  EXPECT_GT(fit, 0.0);
  const auto flags = scan.all(fields::kVertexFlag);
  const auto fits = scan.all(fields::kSmoothingSystem.fit);
  const auto rhs = scan.all(fields::kSmoothingSystem.rhs);
  const TangentFrame f = tangent_frame(Vec3d::UnitZ());
  const Complexd along = symmetry_power(Complexd(f.x.x(), f.y.x()), 4);
  for (std::size_t i = 0; i < flags.size(); ++i) {
    EXPECT_EQ(fits[i] > 0.0F, (flags[i] & kOnBoundary) != 0);
    EXPECT_NEAR(rhs[i].real(), static_cast<float>(along.real()) * fits[i], 1e-4F);
    EXPECT_NEAR(rhs[i].imag(), static_cast<float>(along.imag()) * fits[i], 1e-4F);
  }
  const auto rows = scan.global_rows();
  const auto neighbors = scan.global_neighbors();
  const auto c = scan.all(fields::kSmoothingSystem.coefficient);
  for (std::uint64_t i = 0; i + 1 < rows.size(); ++i) {
    for (std::uint64_t k = rows[i]; k < rows[i + 1]; ++k) {
      const std::uint64_t j = neighbors[k];
      std::uint64_t back = rows[j];
      while (neighbors[back] != i) {
        ++back;
      }
      EXPECT_EQ(c[k].c, std::conj(c[back].c));
    }
  }
}

}  // namespace
}  // namespace rattan
