// SPDX-License-Identifier: MIT
#include "engine/field/curl_correction.h"

#include <cmath>

#include <gtest/gtest.h>

#include "engine/field/curvature.h"
#include "engine/field/low_pass.h"
#include "tests/engine/mesh/test_surfaces.h"

namespace rattan {
namespace {

using testing::bytes_of;
using testing::Surface;
using testing::TiledScan;

struct Analytic {
  Surface surface;
  std::function<Vec3d(const Vec3d&)> normal;
  std::function<Vec3d(const Vec3d&)> direction;
  std::function<double(const Vec3d&)> log_v;
};

Vec3d around(const Vec3d& p) {
  return Vec3d(-p.y(), p.x(), 0.0).normalized();
}

Analytic annulus(std::uint32_t n) {
  return {testing::grid_surface(6 * n, n, true, false,
                                [](double u, double v) {
                                  const double r = 2.0 - v;
                                  return Vec3d(r * std::cos(2 * M_PI * u),
                                               r * std::sin(2 * M_PI * u), 0.0);
                                }),
          [](const Vec3d&) { return Vec3d(0, 0, 1); }, around,
          [](const Vec3d& p) { return -std::log(p.norm()); }};
}

Analytic sphere_band(std::uint32_t n) {
  return {testing::grid_surface(6 * n, 2 * n, true, false,
                                [](double u, double v) {
                                  const double a = 2 * M_PI * u;
                                  const double t = 0.9 * (2.0 * v - 1.0);
                                  return Vec3d(std::cos(t) * std::cos(a), std::cos(t) * std::sin(a),
                                               std::sin(t));
                                }),
          [](const Vec3d& p) -> Vec3d { return p.normalized(); }, around,
          [](const Vec3d& p) { return -0.5 * std::log(p.x() * p.x() + p.y() * p.y()); }};
}

Analytic torus(std::uint32_t n) {
  return {testing::torus(4 * n, 2 * n, 2.0, 0.8),
          [](const Vec3d& p) {
            const Vec3d ring = 2.0 * Vec3d(p.x(), p.y(), 0.0).normalized();
            return (p - ring).normalized();
          },
          around, [](const Vec3d& p) { return -0.5 * std::log(p.x() * p.x() + p.y() * p.y()); }};
}

// Sets exact frames, turned by a vertex-dependent number of quarter turns.
void set_frames(TiledScan& scan, const Analytic& a) {
  std::vector<VertexFrame> frames;
  for (std::size_t i = 0; i < a.surface.positions.size(); ++i) {
    const Vec3d& p = a.surface.positions[i];
    const Vec3d n = a.normal(p);
    Vec3d k = a.direction(p);
    for (std::size_t r = 0; r < i * 7 % 4; ++r) {
      k = n.cross(k);
    }
    frames.push_back({p.cast<float>(), n.cast<float>(), k.cast<float>(), 1.0F});
  }
  scan.set(fields::kFrame, frames);
}

void prepare(TiledScan& scan, EdgeEnergy energy) {
  build_vertex_graph(scan.store, scan.mesh, scan.tasks);
  low_pass_positions(scan.store, scan.mesh, {}, scan.tasks);
  GeometryOptions geometry;
  geometry.energy = energy;
  geometry.curvature_rounds = 0;
  prepare_surface(scan.store, scan.mesh, geometry, scan.tasks);
}

// Conjugate gradients in double precision on the assembled system: the tests' own solver.
std::vector<double> solve(TiledScan& scan) {
  const auto rows = scan.global_rows();
  const auto neighbors = scan.global_neighbors();
  const auto w = scan.all(fields::kEdgeWeight);
  const auto fit = scan.all(fields::kCurlSystem.fit);
  const auto rhs = scan.all(fields::kCurlSystem.rhs);
  const std::size_t n = fit.size();
  const auto multiply = [&](const std::vector<double>& x, std::vector<double>& y) {
    for (std::size_t i = 0; i < n; ++i) {
      double sum = static_cast<double>(fit[i]) * x[i];
      for (std::uint64_t k = rows[i]; k < rows[i + 1]; ++k) {
        sum += static_cast<double>(w[k]) * (x[i] - x[neighbors[k]]);
      }
      y[i] = sum;
    }
  };
  const auto dot = [&](const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      sum += a[i] * b[i];
    }
    return sum;
  };
  std::vector<double> x(n, 0.0);
  std::vector<double> r(rhs.begin(), rhs.end());
  std::vector<double> d = r;
  std::vector<double> q(n);
  double rr = dot(r, r);
  const double stop = 1e-22 * rr;
  for (int it = 0; it < 5000 && rr > stop; ++it) {
    multiply(d, q);
    const double a = rr / dot(d, q);
    for (std::size_t i = 0; i < n; ++i) {
      x[i] += a * d[i];
      r[i] -= a * q[i];
    }
    const double next = dot(r, r);
    for (std::size_t i = 0; i < n; ++i) {
      d[i] = r[i] + next / rr * d[i];
    }
    rr = next;
  }
  return x;
}

double rms_error(const Analytic& a, EdgeEnergy energy) {
  TiledScan scan(a.surface, 1500);
  prepare(scan, energy);
  set_frames(scan, a);
  assemble_curl(scan.store, scan.mesh, scan.tasks);
  const std::vector<double> x = solve(scan);
  double mean = 0.0;
  std::vector<double> error;
  for (std::size_t i = 0; i < x.size(); ++i) {
    error.push_back(x[i] - a.log_v(a.surface.positions[i]));
    mean += error.back();
  }
  mean /= static_cast<double>(x.size());
  double sum = 0.0;
  for (const double e : error) {
    sum += (e - mean) * (e - mean);
  }
  return std::sqrt(sum / static_cast<double>(x.size()));
}

TEST(CurlCorrection, AgreesWithAnalyticScalesAndConverges) {
  struct Case {
    const char* name;
    Analytic (*make)(std::uint32_t);
  };
  for (const Case& c :
       {Case{"annulus", annulus}, Case{"sphere band", sphere_band}, Case{"torus", torus}}) {
    const double coarse = rms_error(c.make(12), EdgeEnergy::kTriangle);
    const double fine = rms_error(c.make(24), EdgeEnergy::kTriangle);
    EXPECT_LT(fine, 1e-3) << c.name;
    EXPECT_LT(fine, 0.6 * coarse) << c.name;
    EXPECT_LT(rms_error(c.make(24), EdgeEnergy::kEdge), 1e-3) << c.name;
  }
}

TEST(CurlCorrection, ClampedWeightsStayConsistent) {
  // A third of the edges of this skewed meshing would have negative weights.
  Analytic a = annulus(24);
  a.surface = testing::grid_surface(
      144, 24, true, false,
      [](double u, double v) {
        const double r = 2.0 - v;
        const double t = 2 * M_PI * (u + 0.25 * v);
        return Vec3d(r * std::cos(t), r * std::sin(t), 0.0);
      },
      [](std::uint32_t, std::uint32_t) { return true; });
  EXPECT_LT(rms_error(a, EdgeEnergy::kTriangle), 5e-3);
}

TEST(CurlCorrection, TargetsSumToZeroAndDoNotDependOnTileSize) {
  const Analytic a = torus(12);
  std::string first;
  for (const std::uint32_t tile : {37U, 300U, 5000U}) {
    TiledScan scan(a.surface, tile);
    prepare(scan, EdgeEnergy::kTriangle);
    set_frames(scan, a);
    assemble_curl(scan.store, scan.mesh, scan.tasks);
    const auto rhs = scan.all(fields::kCurlSystem.rhs);
    double sum = 0.0;
    double size = 0.0;
    for (const float b : rhs) {
      sum += static_cast<double>(b);
      size += std::abs(static_cast<double>(b));
    }
    EXPECT_LT(std::abs(sum), 1e-5 * size);
    if (first.empty()) {
      first = bytes_of(rhs);
    } else {
      EXPECT_TRUE(first == bytes_of(rhs));
    }
  }
}

TEST(CurlCorrection, ScaleKeepsTheFaceCount) {
  const Analytic a = torus(12);
  TiledScan scan(a.surface, 300);
  prepare(scan, EdgeEnergy::kTriangle);
  set_frames(scan, a);
  std::vector<float> log_v;
  for (const Vec3d& p : a.surface.positions) {
    log_v.push_back(static_cast<float>(a.log_v(p)));
  }
  scan.set(fields::kCurlSystem.solution, log_v);
  CurlOptions options;
  options.power = 1.0;
  apply_scale(scan.store, scan.mesh, options, scan.tasks);
  const auto frames = scan.all(fields::kFrame);
  const auto area = scan.all(fields::kVertexArea);
  double total = 0.0;
  double scaled = 0.0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const double v = static_cast<double>(frames[i].scale);
    total += static_cast<double>(area[i]);
    scaled += static_cast<double>(area[i]) * v * v;
    EXPECT_NEAR(v / static_cast<double>(frames[0].scale),
                std::exp(a.log_v(a.surface.positions[i]) - a.log_v(a.surface.positions[0])), 1e-5);
  }
  EXPECT_NEAR(scaled, total, 1e-5 * total);
}

}  // namespace
}  // namespace rattan
