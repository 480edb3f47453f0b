// SPDX-License-Identifier: MIT
#include "engine/field/field_index.h"

#include <cmath>

#include <gtest/gtest.h>

#include "engine/field/curvature.h"
#include "engine/field/low_pass.h"
#include "tests/engine/mesh/test_surfaces.h"

namespace rattan {
namespace {

using testing::Surface;
using testing::TiledScan;

// Frames from the mesh's own normals and a direction per vertex, projected.
void set_frames(TiledScan& scan, const std::function<Vec3d(std::size_t)>& direction) {
  build_vertex_graph(scan.store, scan.mesh, scan.tasks);
  low_pass_positions(scan.store, scan.mesh, {}, scan.tasks);
  prepare_surface(scan.store, scan.mesh, {.curvature_rounds = 0}, scan.tasks);
  const auto normals = scan.all(fields::kNormal);
  const auto positions = scan.all(fields::kSmoothPosition);
  std::vector<VertexFrame> frames;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const Vec3d n = normals[i].cast<double>();
    const Vec3d d = direction(i);
    const Vec3d k = (d - d.dot(n) * n).normalized();
    frames.push_back({positions[i], normals[i], k.cast<float>(), 1.0F});
  }
  scan.set(fields::kFrame, frames);
}

TEST(FieldIndex, AnyFieldSumsToTheEulerCharacteristic) {
  struct Case {
    Surface surface;
    int euler;
  };
  for (const Case& c :
       {Case{testing::sphere(12, 1.0), 2}, Case{testing::torus(40, 24, 2.0, 0.8), 0},
        Case{testing::slab_with_holes(2, 5), -2}, Case{testing::slab_with_holes(3, 5), -4}}) {
    TiledScan scan(c.surface, 300);
    ASSERT_EQ(scan.mesh.topology.euler(), c.euler);
    std::mt19937 random(7);
    std::vector<Vec3d> noise;
    for (std::size_t i = 0; i < c.surface.positions.size(); ++i) {
      const auto unit = [&] { return static_cast<double>(random()) / 4294967295.0 - 0.5; };
      noise.push_back(Vec3d(unit(), unit(), unit()));
    }
    for (const double wild : {0.0, 0.3, 100.0}) {
      set_frames(scan, [&](std::size_t i) -> Vec3d { return Vec3d(0.31, 0.42, 0.87) + wild * noise[i]; });
      for (const Symmetry symmetry : {Symmetry::kOne, Symmetry::kTwo, Symmetry::kFour}) {
        const FieldIndexCount count =
            count_field_singularities(scan.store, scan.mesh, symmetry, scan.tasks);
        EXPECT_EQ(count.sum, static_cast<int>(symmetry) * c.euler) << wild;
      }
    }
  }
}

TEST(FieldIndex, ConstantFieldOnASphereHasTwoPoles) {
  const Surface s = testing::sphere(16, 1.0);
  TiledScan scan(s, 500);
  set_frames(scan, [](std::size_t) { return Vec3d(0.31, 0.42, 0.87); });
  const FieldIndexCount one =
      count_field_singularities(scan.store, scan.mesh, Symmetry::kOne, scan.tasks);
  EXPECT_EQ(one.positive, 2U);
  EXPECT_EQ(one.negative, 0U);
}

TEST(FieldIndex, OneTriangleOfEachKind) {
  // Flat triangle around the origin; direction at angle m * phi has index m.
  for (const int quarters : {-1, 0, 1}) {
    std::array<VertexFrame, 3> f;
    for (int c = 0; c < 3; ++c) {
      const double phi = 0.1 + 2.0 * M_PI * c / 3.0;
      const double a = 0.25 * quarters * phi + 0.7;
      f[c] = {Vec3f(static_cast<float>(std::cos(phi)), static_cast<float>(std::sin(phi)), 0.0F),
              Vec3f::UnitZ(),
              Vec3f(static_cast<float>(std::cos(a)), static_cast<float>(std::sin(a)), 0.0F), 1.0F};
    }
    EXPECT_EQ(triangle_index(f[0], f[1], f[2], 4), quarters);
    EXPECT_EQ(triangle_index(f[1], f[2], f[0], 4), quarters);
  }
}

}  // namespace
}  // namespace rattan
