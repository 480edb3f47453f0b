// SPDX-License-Identifier: MIT
#include "engine/param/parameterize.h"

#include <algorithm>
#include <cmath>
#include <complex>

#include <gtest/gtest.h>

#include "engine/field/field_index.h"
#include "engine/param/periodic_energy.h"
#include "engine/param/solution_record.h"
#include "tests/engine/mesh/test_surfaces.h"

namespace rattan {
namespace {

using testing::bytes_of;
using testing::Surface;
using testing::TiledScan;

// theta and phi at the corners of every triangle, unrolled from the first corner in its gauge;
// `closed` says whether the third edge agrees.
struct Corners {
  std::array<double, 3> theta{};
  std::array<double, 3> phi{};
  std::array<std::uint32_t, 3> r{};
  bool field_closed = false;
  bool phase_closed = false;
};

class Coordinates {
 public:
  Coordinates(TiledScan& scan, double omega)
      : frames_(scan.all(fields::kFrame)), phase_(scan.all(fields::kPhase)), omega_(omega) {}

  Corners triangle(const std::array<std::uint32_t, 3>& t) const {
    Corners c;
    const std::array<double, 2> a = angles(t[0]);
    c.theta[0] = a[0];
    c.phi[0] = a[1];
    step(t[0], t[1], 0, c.theta[0], c.phi[0], c.theta[1], c.phi[1], c.r[1]);
    step(t[0], t[2], 0, c.theta[0], c.phi[0], c.theta[2], c.phi[2], c.r[2]);
    double theta = 0.0;
    double phi = 0.0;
    std::uint32_t r = 0;
    step(t[1], t[2], c.r[1], c.theta[1], c.phi[1], theta, phi, r);
    c.field_closed = r == c.r[2];
    c.phase_closed = std::abs(theta - c.theta[2]) + std::abs(phi - c.phi[2]) < 1.0;
    return c;
  }
  const std::vector<VertexFrame>& frames() const { return frames_; }

 private:
  std::array<double, 2> angles(std::uint32_t i) const {
    return {std::atan2(static_cast<double>(phase_[i].u.imag()),
                       static_cast<double>(phase_[i].u.real())),
            std::atan2(static_cast<double>(phase_[i].v.imag()),
                       static_cast<double>(phase_[i].v.real()))};
  }
  static std::array<double, 2> turn(double a, double b, std::uint32_t r) {
    switch (r & 3U) {
      case 0:
        return {a, b};
      case 1:
        return {b, -a};
      case 2:
        return {-a, -b};
      default:
        return {-b, a};
    }
  }
  // From i, whose gauge is turned by r_i against the triangle's, to j.
  void step(std::uint32_t i, std::uint32_t j, std::uint32_t r_i, double theta_i, double phi_i,
            double& theta_j, double& phi_j, std::uint32_t& r_j) const {
    const EdgeGauge g = i < j ? edge_gauge(frames_[i], frames_[j], omega_)
                              : reverse(edge_gauge(frames_[j], frames_[i], omega_));
    const std::array<double, 2> d = turn(g.delta, g.delta_perp, r_i);
    r_j = (r_i + g.r) & 3U;
    const std::array<double, 2> a = angles(j);
    const std::array<double, 2> p = turn(a[0], a[1], r_j);
    const auto nearest = [](double value, double wanted) {
      return value + 2.0 * M_PI * std::floor((wanted - value) / (2.0 * M_PI) + 0.5);
    };
    theta_j = nearest(p[0], theta_i + d[0]);
    phi_j = nearest(p[1], phi_i + d[1]);
  }

  std::vector<VertexFrame> frames_;
  std::vector<PairValue> phase_;
  double omega_;
};

struct Singular {
  int field = 0;
  int phase = 0;
};

Singular count_singular(TiledScan& scan, const Surface& s, double omega) {
  const Coordinates c(scan, omega);
  Singular n;
  for (const auto& t : s.triangles) {
    const Corners k = c.triangle(t);
    n.field += k.field_closed ? 0 : 1;
    n.phase += k.field_closed && !k.phase_closed ? 1 : 0;
  }
  return n;
}

FieldOptions plain_options(double side) {
  FieldOptions options;
  options.quad_side = side;
  options.low_pass = 0.0;
  options.curl_power = 0.0;
  return options;
}

TEST(Field, ASphereHasEightQuarterPolesFourHalfPolesOrTwoPoles) {
  const Surface s = testing::sphere(24, 1.0);
  for (const auto& [symmetry, poles] :
       {std::pair{Symmetry::kFour, 8U}, std::pair{Symmetry::kTwo, 4U},
        std::pair{Symmetry::kOne, 2U}}) {
    TiledScan scan(s, 1500);
    FieldOptions options = plain_options(0.2);
    options.symmetry = symmetry;
    compute_field(scan.store, scan.mesh, options, scan.tasks);
    const FieldIndexCount count =
        count_field_singularities(scan.store, scan.mesh, symmetry, scan.tasks);
    EXPECT_EQ(count.positive, poles) << static_cast<int>(symmetry);
    EXPECT_EQ(count.negative, 0U);
    EXPECT_EQ(count.sum, static_cast<std::int64_t>(2 * static_cast<int>(symmetry)));
  }
}

TEST(Field, FollowsTheCurvatureOfATorus) {
  TiledScan scan(testing::torus(90, 36, 2.0, 0.6), 700);
  compute_field(scan.store, scan.mesh, plain_options(0.3), scan.tasks);
  const FieldIndexCount count =
      count_field_singularities(scan.store, scan.mesh, Symmetry::kFour, scan.tasks);
  EXPECT_EQ(count.positive + count.negative, 0U);
  double sum = 0.0;
  const auto frames = scan.all(fields::kFrame);
  for (const VertexFrame& f : frames) {
    EXPECT_NEAR(f.direction.norm(), 1.0F, 1e-5F);
    EXPECT_NEAR(f.direction.dot(f.normal), 0.0F, 1e-5F);
    const Vec3f around = Vec3f(-f.position.y(), f.position.x(), 0.0F).normalized();
    const double c = std::abs(static_cast<double>(f.direction.dot(around)));
    const double off = std::min(c, std::sqrt(std::max(0.0, 1.0 - c * c)));
    EXPECT_LT(off, 0.08);  // radians; worst at the borders of these small tiles
    sum += off * off;
  }
  EXPECT_LT(std::sqrt(sum / static_cast<double>(frames.size())), 0.02);
}

TEST(Field, SolvedFieldsSumToTheEulerCharacteristic) {
  for (const auto& [surface, euler] : {std::pair{testing::torus(60, 30, 2.0, 0.8), 0},
                                       std::pair{testing::slab_with_holes(2, 6), -2}}) {
    for (const Symmetry symmetry : {Symmetry::kOne, Symmetry::kTwo, Symmetry::kFour}) {
      TiledScan scan(surface, 500);
      FieldOptions options;
      options.quad_side = 3.0 * scan.mesh.mean_edge_length;
      options.symmetry = symmetry;
      compute_field(scan.store, scan.mesh, options, scan.tasks);
      const FieldIndexCount count =
          count_field_singularities(scan.store, scan.mesh, symmetry, scan.tasks);
      EXPECT_EQ(count.sum, static_cast<int>(symmetry) * euler);
      EXPECT_LT(count.positive + count.negative, 60U);
    }
  }
}

// Two rings of different size and sampling, far apart: neither scales the other.
TEST(Field, CurlCorrectionIsNormalisedOnEveryComponent) {
  Surface s = testing::torus(60, 24, 2.0, 0.8);
  const Surface other = testing::torus(48, 20, 5.0, 1.0);
  const auto first = static_cast<std::uint32_t>(s.positions.size());
  for (const Vec3d& p : other.positions) {
    s.positions.push_back(p + Vec3d(30.0, 0.0, 0.0));
  }
  for (const auto& t : other.triangles) {
    s.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  TiledScan scan(s, 500);
  FieldOptions options = plain_options(0.5);
  options.curl_power = 1.0;
  options.curl_solve.cycles = 8;
  compute_field(scan.store, scan.mesh, options, scan.tasks);
  const auto frames = scan.all(fields::kFrame);
  const auto area = scan.all(fields::kVertexArea);
  std::array<double, 2> mean{};
  std::array<double, 2> total{};
  double low = 1e30;
  double high = 0.0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const int c = i < first ? 0 : 1;
    const double v = static_cast<double>(frames[i].scale);
    mean[c] += static_cast<double>(area[i]) * std::log(v);
    total[c] += static_cast<double>(area[i]);
    low = std::min(low, v);
    high = std::max(high, v);
  }
  EXPECT_GT(high / low, 1.8);  // the correction did something
  EXPECT_NEAR(mean[0] / total[0], mean[1] / total[1], 0.01);
}

// By their geometric mean, or by their mean square: with several tiles in the last pass of the
// solve, with one after it.
TEST(Field, CurlCorrectionHasTheMeanAskedFor) {
  for (const std::uint32_t tile_size : {300U, 100000U}) {
    TiledScan scan(testing::torus(60, 24, 2.0, 1.2), tile_size);
    const auto mean_of = [&](const FieldOptions& options, const auto& f) {
      compute_field(scan.store, scan.mesh, options, scan.tasks);
      const auto frames = scan.all(fields::kFrame);
      const auto area = scan.all(fields::kVertexArea);
      double sum = 0.0;
      double total = 0.0;
      for (std::size_t i = 0; i < frames.size(); ++i) {
        sum += static_cast<double>(area[i]) * f(static_cast<double>(frames[i].scale));
        total += static_cast<double>(area[i]);
      }
      return sum / total;
    };
    const auto square = [](double v) { return v * v; };
    const auto log = [](double v) { return std::log(v); };
    FieldOptions options = plain_options(0.5);
    options.curl_power = 1.0;
    options.fitting_length = 0.5;
    const double spread = mean_of(options, square) / std::exp(2.0 * mean_of(options, log));
    EXPECT_GT(spread, 1.4);
    options.curl_mean = 1.25;
    EXPECT_NEAR(mean_of(options, log), std::log(1.25), 0.01);
    EXPECT_NEAR(mean_of(options, square) / square(1.25), spread, 0.05);
  }
}

TEST(Parameterize, PlaneHasNoSingularityAndExactCoordinates) {
  const Surface s = testing::jittered(testing::plane(40, 30, 8.0, 6.0), 0.0);
  TiledScan scan(s, 300);
  const SurfaceField field = compute_field(scan.store, scan.mesh, plain_options(1.0), scan.tasks);
  ParamOptions options;
  options.omega = 2.0;
  options.solve.newton_steps = 4;
  parameterize(scan.store, scan.mesh, field, options, scan.tasks);
  const Coordinates c(scan, options.omega);
  for (const auto& t : s.triangles) {
    const Corners k = c.triangle(t);
    ASSERT_TRUE(k.field_closed && k.phase_closed);
    // |grad theta| = 2 pi / omega exactly, seen through squared lengths of edges.
    for (int a = 0; a < 3; ++a) {
      const int b = (a + 1) % 3;
      const double parameter = std::hypot(k.theta[b] - k.theta[a], k.phi[b] - k.phi[a]);
      const double length = (s.positions[t[b]] - s.positions[t[a]]).norm();
      EXPECT_NEAR(parameter, 2.0 * M_PI / options.omega * length, 2e-2);
    }
  }
}

TEST(Parameterize, CylinderOfWholePeriodsIsExact) {
  const double radius = 1.5;
  const std::uint32_t around = 60;
  const Surface s = testing::cylinder(around, 30, radius, 4.0);
  TiledScan scan(s, 400);
  FieldOptions field_options = plain_options(0.5);
  field_options.pin_features = false;  // its ends are no whole number of periods apart
  const SurfaceField field = compute_field(scan.store, scan.mesh, field_options, scan.tasks);
  ParamOptions options;
  options.omega = radius * around * std::sin(2.0 * M_PI / around) / 8.0;
  options.solve.newton_steps = 6;
  const SolveReport report = parameterize(scan.store, scan.mesh, field, options, scan.tasks);
  const Singular n = count_singular(scan, s, options.omega);
  EXPECT_EQ(n.field, 0);
  EXPECT_EQ(n.phase, 0);
  EXPECT_LT(report.energy_unit, 0.05);
}

TEST(Parameterize, AnotherPeriodNeedsNoNewField) {
  const Surface s = testing::torus(60, 24, 2.0, 0.6);
  TiledScan scan(s, 400);
  const SurfaceField field = compute_field(scan.store, scan.mesh, plain_options(0.3), scan.tasks);
  const std::string frames = bytes_of(scan.all(fields::kFrame));
  ParamOptions options;
  options.omega = 0.6;
  parameterize(scan.store, scan.mesh, field, options, scan.tasks);
  const std::string first = bytes_of(scan.all(fields::kPhase));
  options.omega = 0.7;
  parameterize(scan.store, scan.mesh, field, options, scan.tasks);
  EXPECT_TRUE(first != bytes_of(scan.all(fields::kPhase)));
  options.omega = 0.6;
  parameterize(scan.store, scan.mesh, field, options, scan.tasks);
  EXPECT_TRUE(first == bytes_of(scan.all(fields::kPhase)));
  EXPECT_TRUE(frames == bytes_of(scan.all(fields::kFrame)));
}

TEST(Parameterize, LeavesRecordsAndOnRequestNorms) {
  const Surface s = testing::jittered(testing::torus(80, 40, 2.0, 0.7), 0.01);
  TiledScan scan(s, 300);
  FieldOptions options;
  options.quad_side = 0.25;
  const SurfaceField field = compute_field(scan.store, scan.mesh, options, scan.tasks);
  const auto of_field = find_record<FieldRecord>(scan.store, fields::kFieldRecord);
  ASSERT_TRUE(of_field);
  EXPECT_EQ(of_field->quad_side, 0.25);
  EXPECT_EQ(of_field->curl_power, options.curl_power);
  ASSERT_EQ(of_field->reports.size(), 2U);
  EXPECT_EQ(of_field->reports[1].energy, field.reports[1].energy);
  EXPECT_FALSE(find_record<PhaseRecord>(scan.store, fields::kPhaseRecord));

  ParamOptions param{.omega = 0.5};
  param.density = 1;
  param.keep_norms = true;
  const SolveReport report = parameterize(scan.store, scan.mesh, field, param, scan.tasks);
  const std::string phases = bytes_of(scan.all(fields::kPhase));
  const auto of_phase = find_record<PhaseRecord>(scan.store, fields::kPhaseRecord);
  ASSERT_TRUE(of_phase);
  EXPECT_EQ(of_phase->omega, 0.5);
  EXPECT_EQ(of_phase->density, 1);
  EXPECT_EQ(of_phase->report.energy, report.energy);
  const auto norms = scan.all(fields::kPhaseNorms);
  ASSERT_EQ(norms.size(), s.positions.size());
  float least = 1.0F;
  double sum = 0.0;
  for (const PartNorms& n : norms) {
    least = std::min({least, n[0], n[1]});
    ASSERT_LT(std::max(n[0], n[1]), 1.3F);
    sum += static_cast<double>(n[0]) + static_cast<double>(n[1]);
  }
  EXPECT_GT(least, 0.0F);
  EXPECT_LT(least, 0.95F);
  EXPECT_NEAR(sum / (2.0 * static_cast<double>(norms.size())), 1.0, 0.1);

  param.keep_norms = false;
  parameterize(scan.store, scan.mesh, field, param, scan.tasks);
  EXPECT_TRUE(phases == bytes_of(scan.all(fields::kPhase)));
  EXPECT_FALSE(scan.store.has_chunk(fields::kPhaseNorms.name, TileId(0)));
  compute_field(scan.store, scan.mesh, options, scan.tasks, &field);
  EXPECT_FALSE(find_record<PhaseRecord>(scan.store, fields::kPhaseRecord));
}

TEST(Parameterize, OneThreadAndTwoGiveTheSameBytes) {
  const Surface s = testing::jittered(testing::torus(80, 40, 2.0, 0.7), 0.01);
  std::string first;
  for (const int threads : {1, 2}) {
    TiledScan scan(s, 300);
    scan.tasks = TaskGraph({.threads = threads});
    FieldOptions options;
    options.quad_side = 0.25;
    const SurfaceField field = compute_field(scan.store, scan.mesh, options, scan.tasks);
    parameterize(scan.store, scan.mesh, field, {.omega = 0.5}, scan.tasks);
    const std::string all = bytes_of(scan.all(fields::kFrame)) + bytes_of(scan.all(fields::kPhase));
    if (first.empty()) {
      first = all;
    } else {
      EXPECT_TRUE(first == all);
    }
  }
}

// PGP Fig. 7: meridians of a surface of revolution diverge; lines must end, unless v grows with
// them.
TEST(Parameterize, CurlCorrectionRemovesSingularitiesOfASurfaceOfRevolution) {
  const Surface s = testing::grid_surface(120, 80, true, false, [](double u, double v) {
    const double a = 2.0 * M_PI * u;
    const double r = 1.0 + 0.5 * std::sin(2.0 * M_PI * v);
    return Vec3d(r * std::cos(a), r * std::sin(a), 4.0 * v);
  });
  FieldOptions options = plain_options(0.1);
  ParamOptions param;
  param.omega = 0.2;
  TiledScan scan(s, 1500);
  SurfaceField field = compute_field(scan.store, scan.mesh, options, scan.tasks);
  parameterize(scan.store, scan.mesh, field, param, scan.tasks);
  const Singular without = count_singular(scan, s, param.omega);
  EXPECT_EQ(without.field, 0);
  EXPECT_GT(without.phase, 10);
  // With full correction, and the period chosen so that a whole number of them goes around.
  field.options.curl_power = 1.0;
  field.options.curl_solve.cycles = 8;
  correct_curl(scan.store, scan.mesh, field, scan.tasks);
  double around = 0.0;
  const auto frames = scan.all(fields::kFrame);
  for (std::uint32_t i = 0; i < 120; ++i) {
    const VertexFrame& f = frames[40 * 120 + i];
    around += 2.0 * M_PI * static_cast<double>(f.position.head<2>().norm()) *
              static_cast<double>(f.scale) / 120.0;
  }
  param.omega = around / std::round(around / param.omega);
  param.solve.newton_steps = 3;
  parameterize(scan.store, scan.mesh, field, param, scan.tasks);
  const Singular with = count_singular(scan, s, param.omega);
  EXPECT_EQ(with.field, 0);
  EXPECT_EQ(with.phase, 0);
}

TEST(Passes, DoNotGrowWithTheScan) {
  for (const std::uint32_t around : {60U, 120U, 240U}) {
    const Surface s = testing::torus(around, around / 2, 2.0, 0.8);
    TiledScan scan(s, 300);
    FieldOptions options;
    options.quad_side = 0.2;
    const SurfaceField field = compute_field(scan.store, scan.mesh, options, scan.tasks);
    const auto rounds = static_cast<unsigned>(field.geometry.curvature_rounds);
    EXPECT_LE(rounds, 6U);
    EXPECT_EQ(scan.tasks.passes(), 15U + rounds);
    parameterize(scan.store, scan.mesh, field, {.omega = 0.4}, scan.tasks);
    EXPECT_EQ(scan.tasks.passes(), 18U + rounds);
  }
}

}  // namespace
}  // namespace rattan
