// SPDX-License-Identifier: MIT
#include "engine/param/periodic_energy.h"

#include <cmath>
#include <complex>

#include <gtest/gtest.h>

#include "engine/field/curvature.h"
#include "engine/field/low_pass.h"
#include "tests/engine/mesh/test_surfaces.h"

namespace rattan {
namespace {

using testing::bytes_of;
using testing::Surface;
using testing::TiledScan;
using Phase = std::array<double, 2>;

void prepare(TiledScan& scan) {
  build_vertex_graph(scan.store, scan.mesh, scan.tasks);
  low_pass_positions(scan.store, scan.mesh, {}, scan.tasks);
  prepare_surface(scan.store, scan.mesh, {.curvature_rounds = 0}, scan.tasks);
}

// Frames with directions projected to the tangent planes, turned by i * 7 % 4 quarter turns if
// asked.
std::vector<VertexFrame> frames_of(TiledScan& scan, bool turned,
                                   const std::function<Vec3d(const Vec3d&)>& direction) {
  const auto normals = scan.all(fields::kNormal);
  const auto positions = scan.all(fields::kSmoothPosition);
  std::vector<VertexFrame> frames;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const Vec3d n = normals[i].cast<double>();
    const Vec3d d = direction(positions[i].cast<double>());
    Vec3d k = (d - d.dot(n) * n).normalized();
    for (std::size_t r = 0; turned && r < i * 7 % 4; ++r) {
      k = n.cross(k);
    }
    frames.push_back({positions[i], normals[i], k.cast<float>(), 1.0F});
  }
  return frames;
}

struct Row {
  std::uint64_t neighbor;
  PairBlock::Coefficient coefficient;
  double weight;
};

struct System {
  std::vector<std::vector<Row>> rows;
  std::vector<double> diagonal;
};

System read_system(TiledScan& scan) {
  System s;
  const auto rows = scan.global_rows();
  const auto neighbors = scan.global_neighbors();
  const auto c = scan.all(fields::kPhaseSystem.coefficient);
  const auto w = scan.all(fields::kEdgeWeight);
  s.rows.resize(rows.size() - 1);
  for (std::size_t i = 0; i + 1 < rows.size(); ++i) {
    for (std::uint64_t k = rows[i]; k < rows[i + 1]; ++k) {
      s.rows[i].push_back({neighbors[k], c[k], static_cast<double>(w[k])});
    }
  }
  for (const float d : scan.all(fields::kDiagonal)) {
    s.diagonal.push_back(static_cast<double>(d));
  }
  return s;
}

// The phases of j as seen from i: theta' and phi' of EdgeGauge.
Phase turned(const Phase& p, std::uint32_t r) {
  switch (r) {
    case 0:
      return p;
    case 1:
      return {p[1], -p[0]};
    case 2:
      return {-p[0], -p[1]};
    default:
      return {-p[1], p[0]};
  }
}

// PGP Eq. 14 for unit norms, straight from angles: sum of w (2 - 2 cos(theta_j' - theta_i -
// delta)).
double energy_of_angles(const System& s, const std::vector<VertexFrame>& frames,
                        const std::vector<Phase>& phase, double omega) {
  double sum = 0.0;
  for (std::size_t i = 0; i < s.rows.size(); ++i) {
    for (const Row& row : s.rows[i]) {
      if (row.neighbor < i) {
        continue;
      }
      const EdgeGauge g = edge_gauge(frames[i], frames[row.neighbor], omega);
      const Phase p = turned(phase[row.neighbor], g.r);
      sum += row.weight * (4.0 - 2.0 * std::cos(p[0] - phase[i][0] - g.delta) -
                           2.0 * std::cos(p[1] - phase[i][1] - g.delta_perp));
    }
  }
  return sum;
}

// D_i x_i - sum_j C_ij x_j: half the gradient of the energy, in double precision.
struct Pair {
  std::complex<double> u;
  std::complex<double> v;
};

Pair half_gradient(const System& s, const std::vector<Pair>& x, std::size_t i) {
  Pair g{s.diagonal[i] * x[i].u, s.diagonal[i] * x[i].v};
  for (const Row& row : s.rows[i]) {
    Pair y = x[row.neighbor];
    if (row.coefficient.r == 1) {
      y = {y.v, std::conj(y.u)};
    } else if (row.coefficient.r == 2) {
      y = {std::conj(y.u), std::conj(y.v)};
    } else if (row.coefficient.r == 3) {
      y = {std::conj(y.v), y.u};
    }
    g.u -= std::complex<double>(row.coefficient.a) * y.u;
    g.v -= std::complex<double>(row.coefficient.b) * y.v;
  }
  return g;
}

std::vector<Pair> to_pairs(const std::vector<Phase>& phase) {
  std::vector<Pair> x;
  for (const Phase& p : phase) {
    x.push_back({std::polar(1.0, p[0]), std::polar(1.0, p[1])});
  }
  return x;
}

TEST(PeriodicEnergy, GradientAgreesWithFiniteDifferences) {
  TiledScan scan(testing::jittered(testing::torus(14, 10, 2.0, 0.8), 0.05), 40);
  prepare(scan);
  const double omega = 1.3;
  const auto frames = frames_of(scan, true, [](const Vec3d& p) {
    return Vec3d(std::sin(3 * p.x()), std::cos(2 * p.y()), std::sin(p.z() + p.x()));
  });
  scan.set(fields::kFrame, frames);
  assemble_phase(scan.store, scan.mesh, omega, scan.tasks);
  const System s = read_system(scan);
  std::vector<Phase> phase;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    phase.push_back({std::sin(1.0 + 13.0 * static_cast<double>(i)) * 3.0,
                     std::cos(2.0 + 7.0 * static_cast<double>(i)) * 3.0});
  }
  const std::vector<Pair> x = to_pairs(phase);
  int turns[4] = {0, 0, 0, 0};
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Pair g = half_gradient(s, x, i);
    for (int c = 0; c < 2; ++c) {
      // d/d theta of the energy: 2 Re(conj(g) dx/d theta), dx/d theta = i x.
      const std::complex<double> gc = c == 0 ? g.u : g.v;
      const std::complex<double> xc = c == 0 ? x[i].u : x[i].v;
      const double exact = 2.0 * (std::conj(gc) * std::complex<double>(0.0, 1.0) * xc).real();
      const double step = 1e-5;
      auto moved = phase;
      moved[i][c] += step;
      const double up = energy_of_angles(s, frames, moved, omega);
      moved[i][c] -= 2 * step;
      const double down = energy_of_angles(s, frames, moved, omega);
      EXPECT_NEAR((up - down) / (2 * step), exact, 2e-5);
    }
    for (const Row& row : s.rows[i]) {
      ++turns[row.coefficient.r];
    }
  }
  for (const int t : turns) {
    EXPECT_GT(t, 50);  // every quarter turn was tried
  }
}

TEST(PeriodicEnergy, CoefficientsAreExactAdjointsAndDoNotDependOnTileSize) {
  const Surface surface = testing::jittered(testing::torus(30, 20, 2.0, 0.8), 0.03);
  std::string first;
  for (const std::uint32_t tile : {23U, 150U, 5000U}) {
    TiledScan scan(surface, tile);
    prepare(scan);
    scan.set(fields::kFrame, frames_of(scan, true, [](const Vec3d& p) {
               return Vec3d(std::sin(3 * p.x()), std::cos(2 * p.y()), std::sin(p.z() + p.x()));
             }));
    assemble_phase(scan.store, scan.mesh, 0.7, scan.tasks);
    const System s = read_system(scan);
    for (std::size_t i = 0; i < s.rows.size(); ++i) {
      for (const Row& row : s.rows[i]) {
        for (const Row& back : s.rows[row.neighbor]) {
          if (back.neighbor == i) {
            const PairBlock::Coefficient c = adjoint(row.coefficient);
            EXPECT_EQ(c.a, back.coefficient.a);
            EXPECT_EQ(c.b, back.coefficient.b);
            EXPECT_EQ(c.r, back.coefficient.r);
          }
        }
      }
    }
    const std::string all = bytes_of(scan.all(fields::kPhaseSystem.coefficient));
    if (first.empty()) {
      first = all;
    } else {
      EXPECT_TRUE(first == all);
    }
  }
}

TEST(PeriodicEnergy, AdjointUndoesAnIsometry) {
  const PairValue x{Complex(0.6F, 0.8F), Complex(-0.28F, 0.96F)};
  for (std::uint32_t r = 0; r < 4; ++r) {
    const PairBlock::Coefficient c = pair_coefficient({r, 0.7, -2.1}, 1.0F);
    const PairBlock::Coefficient other = pair_coefficient(reverse({r, 0.7, -2.1}), 1.0F);
    const PairValue y = apply(adjoint(c), apply(c, x));
    EXPECT_NEAR(std::abs(y.u - x.u), 0.0F, 1e-6F);
    EXPECT_NEAR(std::abs(y.v - x.v), 0.0F, 1e-6F);
    EXPECT_EQ(adjoint(c).r, other.r);
    EXPECT_NEAR(std::abs(adjoint(c).a - other.a), 0.0F, 1e-6F);
    EXPECT_NEAR(std::abs(adjoint(c).b - other.b), 0.0F, 1e-6F);
  }
}

// Zero energy where exact coordinates exist: a plane under any quarter turns, and a cylinder whose
// circumference is a whole number of periods.
TEST(PeriodicEnergy, ExactCoordinatesHaveNoEnergy) {
  const double radius = 2.0;
  // Along a chord the tangents of its two ends measure chord * cos(half its angle).
  const double omega = radius * std::sin(2.0 * M_PI / 48.0) * 48.0 / 6.0;
  struct Case {
    Surface surface;
    std::function<Vec3d(const Vec3d&)> direction;
    std::function<Phase(const Vec3d&)> phase;
  };
  const std::vector<Case> cases = {
      {testing::plane(11, 8, 5.0, 4.0), [](const Vec3d&) { return Vec3d(0.6, 0.8, 0.0); },
       [&](const Vec3d& p) {
         const double f = 2.0 * M_PI / omega;
         return Phase{f * (0.6 * p.x() + 0.8 * p.y()), f * (0.6 * p.y() - 0.8 * p.x())};
       }},
      {testing::cylinder(48, 10, radius, 4.0),
       [](const Vec3d& p) { return Vec3d(-p.y(), p.x(), 0.0); },
       [&](const Vec3d& p) {
         return Phase{6.0 * std::atan2(p.y(), p.x()), 2.0 * M_PI / omega * p.z()};
       }}};
  for (const Case& c : cases) {
    TiledScan scan(c.surface, 30);
    prepare(scan);
    const auto plain = frames_of(scan, false, c.direction);
    const auto frames = frames_of(scan, true, c.direction);
    scan.set(fields::kFrame, frames);
    assemble_phase(scan.store, scan.mesh, omega, scan.tasks);
    const System s = read_system(scan);
    std::vector<Phase> phase;
    for (std::size_t i = 0; i < plain.size(); ++i) {
      // In a frame turned by r, (theta, phi) reads as seen from the plain frame turned back.
      phase.push_back(
          turned(c.phase(plain[i].position.cast<double>()), static_cast<std::uint32_t>(i * 7 % 4)));
    }
    const double energy = energy_of_angles(s, frames, phase, omega);
    EXPECT_LT(energy, 1e-8);
    const std::vector<Pair> x = to_pairs(phase);
    for (std::size_t i = 0; i < x.size(); ++i) {
      const Pair g = half_gradient(s, x, i);
      EXPECT_LT(std::abs(g.u) + std::abs(g.v), 1e-4);
    }
  }
}

}  // namespace
}  // namespace rattan
