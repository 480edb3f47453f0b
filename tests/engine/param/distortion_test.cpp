// SPDX-License-Identifier: MIT
#include "engine/param/distortion.h"

#include <cmath>

#include <gtest/gtest.h>

#include "engine/core/exact_math.h"
#include "engine/param/parameterize.h"
#include "engine/param/phase_fields.h"
#include "tests/engine/mesh/test_surfaces.h"

namespace rattan {
namespace {

using testing::Surface;
using testing::TiledScan;

// A tilted plane, so that all three coordinates matter.
Vec3d on_plane(double x, double y) {
  return Vec3d(1.0, -2.0, 5.0) + x * Vec3d(2.0, 2.0, 1.0) / 3.0 + y * Vec3d(-2.0, 1.0, 2.0) / 3.0;
}

// Triangles of different shapes, their parameters those of the plane through `map`.
template <class Map>
DistortionSums of_map(const Map& map, int count = 200) {
  DistortionSums sums;
  std::uint64_t state = 7;
  const auto random = [&] {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(state >> 11) * 0x1p-53;
  };
  for (int i = 0; i < count; ++i) {
    std::array<Vec3d, 3> surface;
    std::array<Vec2d, 3> parameter;
    const double x = 10.0 * random();
    const double y = 10.0 * random();
    for (int k = 0; k < 3; ++k) {
      const double a = 2.0 * M_PI * (k + 0.6 * random()) / 3.0;
      const double r = 0.1 + random();
      const double px = x + r * std::cos(a);
      const double py = y + r * std::sin(a);
      surface[k] = on_plane(px, py);
      parameter[k] = map(px, py);
    }
    sums.add(surface, parameter);
  }
  return sums;
}

void expect_distortion(const DistortionSums& sums, double stretch, double shear) {
  EXPECT_NEAR(sums.stretch(), stretch, 1e-12 * stretch);
  EXPECT_NEAR(sums.stretch_trimmed(), stretch, 1e-12 * stretch);
  EXPECT_NEAR(sums.shear(), shear, 1e-12);
}

TEST(Distortion, IsometriesAndUniformScalesHaveNone) {
  expect_distortion(of_map([](double x, double y) { return Vec2d(x, y); }), 1.0, 0.0);
  expect_distortion(of_map([](double x, double y) {
                      return Vec2d(0.6 * x - 0.8 * y + 3.0,  //
                                   0.8 * x + 0.6 * y);
                    }),
                    1.0, 0.0);
  expect_distortion(of_map([](double x, double y) { return Vec2d(7.0 * x, 7.0 * y); }), 1.0, 0.0);
  // Also where everything is folded over.
  expect_distortion(of_map([](double x, double y) { return Vec2d(y, x); }), 1.0, 0.0);
}

// From parameters to the surface u is stretched by 1 / s and v by 1 / t: with areas made equal,
// sqrt((1 / s^2 + 1 / t^2) / 2) sqrt(s t).
TEST(Distortion, AnisotropyStretches) {
  for (const auto& [s, t] : {std::pair{2.0, 1.0}, std::pair{3.0, 0.5}, std::pair{0.1, 0.4}}) {
    const double stretch = std::sqrt((1.0 / (s * s) + 1.0 / (t * t)) / 2.0 * s * t);
    expect_distortion(of_map([s = s, t = t](double x, double y) { return Vec2d(s * x, t * y); }),
                      stretch, 0.0);
  }
}

// u = x + c y, v = y: S_u = (1, 0), S_v = (-c, 1).
TEST(Distortion, LeaningLinesShear) {
  for (const double c : {0.2, -1.0, 3.0}) {
    expect_distortion(of_map([c](double x, double y) { return Vec2d(x + c * y, y); }),
                      std::sqrt((2.0 + c * c) / 2.0), std::abs(c) / std::sqrt(1.0 + c * c));
  }
}

// Half the area at scale 1, half at scale 2: stretch sqrt((1 + 1/4) / 2) sqrt((1 + 4) / 2).
TEST(Distortion, WeighsByArea) {
  DistortionSums sums;
  const std::array<Vec3d, 3> big{on_plane(0, 0), on_plane(2, 0), on_plane(0, 1)};
  sums.add(big, {Vec2d(0, 0), Vec2d(2, 0), Vec2d(0, 1)});
  const std::array<Vec3d, 3> small{on_plane(0, 0), on_plane(1, 0), on_plane(0, 1)};
  for (int i = 0; i < 2; ++i) {
    sums.add(small, {Vec2d(0, 0), Vec2d(2, 0), Vec2d(0, 2)});
  }
  EXPECT_NEAR(sums.totals().area, 2.0, 1e-12);
  EXPECT_NEAR(sums.totals().parameter, 5.0, 1e-12);
  EXPECT_NEAR(sums.stretch(), std::sqrt(1.25 / 2.0 * 5.0 / 2.0), 1e-12);
  EXPECT_NEAR(sums.shear(), 0.0, 1e-12);
}

TEST(Distortion, TrimmingDropsOutliers) {
  DistortionSums sums;
  const std::array<Vec3d, 3> t{on_plane(0, 0), on_plane(1, 0), on_plane(0, 1)};
  for (int i = 0; i < 999; ++i) {
    sums.add(t, {Vec2d(0, 0), Vec2d(1, 0), Vec2d(0, 1)});
  }
  sums.add(t, {Vec2d(0, 0), Vec2d(0.01, 0), Vec2d(0, 0.01)});  // L2 = 100
  EXPECT_NEAR(sums.stretch_trimmed(), 1.0, 1e-12);
  EXPECT_NEAR(sums.stretch(), std::sqrt((999.0 + 1e4) / 1000.0 * (999.0 + 1e-4) / 1000.0), 1e-9);
  // Without area in parameter space, or none on the surface.
  sums.add(t, {Vec2d(0, 0), Vec2d(1, 1), Vec2d(2, 2)});
  EXPECT_NEAR(sums.stretch_trimmed(), 1.0, 1e-12);
  EXPECT_GT(sums.stretch(), 20.0);
  EXPECT_LE(sums.stretch(), kMostStretch);
  const DistortionTotals before = sums.totals();
  sums.add({on_plane(0, 0), on_plane(0, 0), on_plane(1, 0)},
           {Vec2d(0, 0), Vec2d(1, 0), Vec2d(0, 1)});
  EXPECT_EQ(sums.totals().area, before.area);
  EXPECT_EQ(sums.totals().area_stretch2, before.area_stretch2);
}

// Against sorting, with stretches that all differ; the cut falls inside a bin.
TEST(Distortion, TrimsAsSortingWould) {
  DistortionSums sums;
  std::vector<double> scales;
  for (int i = 0; i < 5000; ++i) {
    scales.push_back(std::exp(0.0004 * i));
  }
  const std::array<Vec3d, 3> t{on_plane(0, 0), on_plane(1, 0), on_plane(0, 1)};
  for (const double s : scales) {
    sums.add(t, {Vec2d(0, 0), Vec2d(1.0 / s, 0), Vec2d(0, 1.0 / s)});
  }
  for (const double share : {0.25, 0.5, 0.99, 1.0}) {
    const auto kept = static_cast<std::size_t>(share * 5000.0);
    double stretch2 = 0.0;
    double parameter = 0.0;
    for (std::size_t i = 0; i < kept; ++i) {
      stretch2 += scales[i] * scales[i];
      parameter += 1.0 / (scales[i] * scales[i]);
    }
    const double n = static_cast<double>(kept);
    EXPECT_NEAR(sums.stretch_trimmed(share), std::sqrt(stretch2 / n * parameter / n), 1e-4);
  }
}

TEST(Distortion, MergesLikeAdding) {
  const auto map = [](double x, double y) { return Vec2d(x + 0.01 * x * x, y - 0.02 * x * y); };
  DistortionSums all = of_map(map, 300);
  DistortionSums merged = of_map(map, 300);
  DistortionSums more = of_map([&](double x, double y) { return map(y, x); }, 100);
  EXPECT_NE(all.stretch(), more.stretch());
  all.merge(more);
  merged.merge(more);
  EXPECT_EQ(all.stretch(), merged.stretch());
  EXPECT_EQ(all.stretch_trimmed(), merged.stretch_trimmed());
  DistortionTotals totals = more.totals();
  totals += of_map(map, 300).totals();
  EXPECT_NEAR(totals.stretch(), all.stretch(), 1e-12);
  EXPECT_NEAR(totals.shear(), all.shear(), 1e-12);
}

// An isometric phase and a leaning one, given: the pass finds the map's own distortion, whatever
// gauge the vertices are in.
TEST(Distortion, OfAPhaseIsThatOfItsCoordinates) {
  const double omega = 0.9;
  for (const double c : {0.0, 0.3}) {
    const Surface plane = testing::plane(24, 20, 6.0, 5.0);
    TiledScan scan(plane, 100);
    std::vector<VertexFrame> frames;
    std::vector<PairValue> phases;
    for (std::size_t i = 0; i < plane.positions.size(); ++i) {
      VertexFrame f;
      f.position = plane.positions[i].cast<float>();
      const double x = plane.positions[i].x();
      const double y = plane.positions[i].y();
      double a = 2.0 * M_PI / omega * (x + c * y);
      double b = 2.0 * M_PI / omega * y;
      const std::uint32_t r = static_cast<std::uint32_t>(i * 2654435761U >> 7) & 3U;
      const std::array<Vec3f, 4> turned{Vec3f(1, 0, 0), Vec3f(0, 1, 0), Vec3f(-1, 0, 0),
                                        Vec3f(0, -1, 0)};
      f.direction = turned[r];
      quarter_turns(r, a, b);
      frames.push_back(f);
      const auto unit = [](double angle) {
        return Complex(static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)));
      };
      phases.push_back({unit(a), unit(b)});
    }
    scan.set(fields::kFrame, frames);
    scan.set(fields::kPhase, phases);
    const DistortionSums sums = measure_distortion(scan.store, scan.mesh, omega, scan.tasks);
    EXPECT_NEAR(sums.totals().area, 30.0, 1e-4);
    EXPECT_NEAR(sums.totals().parameter, 30.0, 1e-4);
    EXPECT_NEAR(sums.stretch(), std::sqrt((2.0 + c * c) / 2.0), 1e-5);
    EXPECT_NEAR(sums.stretch_trimmed(), std::sqrt((2.0 + c * c) / 2.0), 1e-5);
    EXPECT_NEAR(sums.shear(), c / std::sqrt(1.0 + c * c), 1e-5);
  }
}

TEST(Distortion, DoesNotDependOnThreads) {
  const auto measure = [](int threads) {
    TiledScan scan(testing::torus(90, 40, 2.0, 0.7), 300);
    TaskGraph tasks({.threads = threads});
    FieldOptions field_options;
    field_options.quad_side = 0.4;
    const SurfaceField field = compute_field(scan.store, scan.mesh, field_options, tasks);
    parameterize(scan.store, scan.mesh, field, {.omega = 0.4, .density = 1}, tasks);
    return measure_distortion(scan.store, scan.mesh, 0.4, tasks);
  };
  const DistortionSums one = measure(1);
  const DistortionSums three = measure(3);
  EXPECT_EQ(one.stretch(), three.stretch());
  EXPECT_EQ(one.stretch_trimmed(), three.stretch_trimmed());
  EXPECT_EQ(one.shear(), three.shear());
  EXPECT_GT(one.stretch_trimmed(), 1.0);
  EXPECT_LT(one.stretch_trimmed(), 1.2);
  EXPECT_GE(one.stretch(), one.stretch_trimmed());
  EXPECT_LT(one.shear(), 0.3);
}

}  // namespace
}  // namespace rattan
