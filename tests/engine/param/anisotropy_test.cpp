// SPDX-License-Identifier: MIT
//
// PGP Fig. 16: a torus meshed with triangles three times longer than wide, lying at 45 degrees to
// its curvature lines. With the triangle energy the lines are those of an even meshing; with the
// edge energy they lean with the mesh.
#include <cmath>

#include <gtest/gtest.h>

#include "engine/param/parameterize.h"
#include "engine/param/phase_fields.h"
#include "tests/engine/mesh/test_surfaces.h"

namespace rattan {
namespace {

using testing::Surface;
using testing::TiledScan;

constexpr double kBig = 1.8;
constexpr double kSmall = 0.3;

Vec3d torus_point(double a, double b) {
  const double rho = kBig + kSmall * std::cos(b);
  return Vec3d(rho * std::cos(a), rho * std::sin(a), kSmall * std::sin(b));
}

// Rows of many points along curves that wind once around and six times across (45 degrees), rows
// far apart; neighbouring rows are zipped by the shorter diagonal.
Surface slanted_torus(std::uint32_t points, std::uint32_t rows) {
  Surface s;
  for (std::uint32_t j = 0; j < rows; ++j) {
    for (std::uint32_t i = 0; i < points; ++i) {
      const double u = 2.0 * M_PI * i / points;
      s.positions.push_back(torus_point(u, kBig / kSmall * u + 2.0 * M_PI * j / rows));
    }
  }
  for (std::uint32_t j = 0; j < rows; ++j) {
    const auto low = [&](std::uint32_t i) { return j * points + i % points; };
    const auto high = [&](std::uint32_t i) { return (j + 1) % rows * points + i % points; };
    const auto gap = [&](std::uint32_t a, std::uint32_t b) {
      return (s.positions[a] - s.positions[b]).norm();
    };
    std::uint32_t start = 0;
    for (std::uint32_t i = 1; i < points; ++i) {
      start = gap(low(0), high(i)) < gap(low(0), high(start)) ? i : start;
    }
    std::uint32_t p = 0;
    std::uint32_t q = 0;
    while (p < points || q < points) {
      const bool step_low = q == points || (p < points && gap(low(p + 1), high(start + q)) <
                                                              gap(low(p), high(start + q + 1)));
      if (step_low) {
        s.triangles.push_back({low(p), low(p + 1), high(start + q)});
        ++p;
      } else {
        s.triangles.push_back({low(p), high(start + q + 1), high(start + q)});
        ++q;
      }
    }
  }
  return s;
}

// Area-weighted mean of |sin| of the angle between grad theta and the direction around the torus.
double lean_of_lines(const Surface& s, EdgeEnergy energy) {
  TiledScan scan(s, 1000);
  FieldOptions field_options;
  field_options.quad_side = 0.4;
  field_options.low_pass = 0.0;
  field_options.energy = energy;
  field_options.curl_power = 0.0;
  const SurfaceField field = compute_field(scan.store, scan.mesh, field_options, scan.tasks);
  // The exact field, the same for every meshing.
  std::vector<VertexFrame> frames = scan.all(fields::kFrame);
  for (VertexFrame& f : frames) {
    const Vec3f around = Vec3f(-f.position.y(), f.position.x(), 0.0F);
    f.direction = (around - around.dot(f.normal) * f.normal).normalized();
  }
  scan.set(fields::kFrame, frames);
  ParamOptions options;
  options.omega = 2.0 * M_PI * kBig / 6.0;
  options.solve.newton_steps = 8;
  options.solve.tolerance = 1e-3F;
  parameterize(scan.store, scan.mesh, field, options, scan.tasks);
  const std::vector<PairValue> phase = scan.all(fields::kPhase);
  const auto theta = [&](std::uint32_t i) {
    return std::atan2(static_cast<double>(phase[i].u.imag()),
                      static_cast<double>(phase[i].u.real()));
  };
  const auto wrap = [](double x) { return x - 2.0 * M_PI * std::floor(x / (2.0 * M_PI) + 0.5); };
  double lean = 0.0;
  double area = 0.0;
  for (const auto& t : s.triangles) {
    const Vec3d ab = s.positions[t[1]] - s.positions[t[0]];
    const Vec3d ac = s.positions[t[2]] - s.positions[t[0]];
    const double d_ab = wrap(theta(t[1]) - theta(t[0]));
    const double d_ac = wrap(theta(t[2]) - theta(t[0]));
    const Vec3d n = ab.cross(ac);
    const Vec3d gradient = (d_ab * ac.cross(n) - d_ac * ab.cross(n)) / n.squaredNorm();
    const Vec3d center = (s.positions[t[0]] + s.positions[t[1]] + s.positions[t[2]]) / 3.0;
    const Vec3d turn(-center.y(), center.x(), 0.0);
    const Vec3d around = (turn - turn.dot(n) / n.squaredNorm() * n).normalized();
    const double along = gradient.dot(around) / gradient.norm();
    lean += n.norm() * std::sqrt(std::max(0.0, 1.0 - along * along));
    area += n.norm();
  }
  return lean / area;
}

TEST(Anisotropy, TriangleEnergyDoesNotFollowTheMeshing) {
  const Surface slanted = slanted_torus(480, 16);
  const Surface even = testing::torus(140, 24, kBig, kSmall);
  ASSERT_EQ(TiledScan(slanted, 100000).mesh.topology.euler(), 0);
  const double even_triangle = lean_of_lines(even, EdgeEnergy::kTriangle);
  const double slanted_triangle = lean_of_lines(slanted, EdgeEnergy::kTriangle);
  const double slanted_edge = lean_of_lines(slanted, EdgeEnergy::kEdge);
  EXPECT_LT(even_triangle, 0.015);
  EXPECT_LT(slanted_triangle, 0.015);
  EXPECT_GT(slanted_edge, 0.05);
}

}  // namespace
}  // namespace rattan
