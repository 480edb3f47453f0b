// SPDX-License-Identifier: MIT
#include "engine/mesh/features.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/engine/mesh/test_surfaces.h"

namespace rattan {
namespace {

using testing::Surface;
using testing::TiledScan;

FeatureSet features_of(const Surface& s, const FeatureOptions& options, std::uint32_t tile = 64) {
  TiledScan scan(s, tile);
  build_vertex_graph(scan.store, scan.mesh, scan.tasks);
  return find_features(scan.store, scan.mesh, options, scan.tasks);
}

/// A roof over the unit square: folded along v = 0.5, and rough by up to `noise`.
Surface roof(std::uint32_t n, double slope, double noise) {
  Surface s = testing::grid_surface(n, n, false, false, [=](double u, double v) {
    return Vec3d(u, v, slope * std::abs(v - 0.5));
  });
  std::mt19937 random(7);
  for (Vec3d& p : s.positions) {
    p.z() += noise * (static_cast<double>(random()) / 4294967296.0 - 0.5);
  }
  return s;
}

FeatureOptions with_side(double side) {
  FeatureOptions o;
  o.side = side;
  return o;
}

TEST(Features, FoldIsOneCurve) {
  const std::uint32_t n = 24;
  for (const double noise : {0.0, 0.004}) {
    const FeatureSet f = features_of(roof(n, 1.0, noise), with_side(3.0 / n));
    std::uint64_t creases = 0;
    for (const FeatureEdge& e : f.edges()) {
      if (!e.boundary) {
        ++creases;
        EXPECT_NEAR(static_cast<double>(e.p_lo.y()), 0.5, 1e-6);
        EXPECT_NEAR(static_cast<double>(e.p_hi.y()), 0.5, 1e-6);
      }
    }
    EXPECT_EQ(creases, n);
    EXPECT_EQ(f.crease_edges(), n);
    // The square's corners, and where the fold meets the boundary; that turns there by itself.
    EXPECT_EQ(f.corners().size(), 6U);
    EXPECT_EQ(f.curve_count(), 7U);
  }
}

TEST(Features, NoiseIsNone) {
  const std::uint32_t n = 40;
  for (const double noise : {0.01, 0.02, 0.04}) {
    const FeatureSet f = features_of(roof(n, 0.0, noise), with_side(3.0 / n));
    EXPECT_EQ(f.crease_edges(), 0U) << noise;
    EXPECT_GE(f.corners().size(), 4U);
  }
}

TEST(Features, SmoothSurfacesHaveNone) {
  EXPECT_TRUE(features_of(testing::torus(40, 20, 2.0, 0.7), with_side(0.6)).empty());
  const FeatureSet f = features_of(testing::cylinder(48, 20, 1.0, 2.0), with_side(0.4));
  EXPECT_EQ(f.crease_edges(), 0U);
  EXPECT_EQ(f.curve_count(), 2U);  // both ends
  EXPECT_TRUE(f.corners().empty());
}

TEST(Features, AngleAndLengthDecide) {
  const std::uint32_t n = 24;
  FeatureOptions options = with_side(3.0 / n);
  // Slopes of +-0.5 turn by 53 degrees.
  options.crease_degrees = 60.0;
  EXPECT_EQ(features_of(roof(n, 0.5, 0.0), options).crease_edges(), 0U);
  options.crease_degrees = 50.0;
  EXPECT_EQ(features_of(roof(n, 0.5, 0.0), options).crease_edges(), n);
  options.creases = false;
  EXPECT_EQ(features_of(roof(n, 0.5, 0.0), options).crease_edges(), 0U);
  // A fold of less than a few quads is not worth a curve, nor is a small hole.
  EXPECT_TRUE(features_of(roof(n, 0.5, 0.0), with_side(1.0)).empty());
}

TEST(Features, TilesMakeNoDifference) {
  const Surface s = roof(30, 1.0, 0.003);
  const FeatureSet whole = features_of(s, with_side(0.1), 100000);
  for (const std::uint32_t tile : {37U, 200U}) {
    const FeatureSet f = features_of(s, with_side(0.1), tile);
    ASSERT_EQ(f.edges().size(), whole.edges().size());
    for (std::size_t i = 0; i < f.edges().size(); ++i) {
      EXPECT_EQ(f.edges()[i].lo, whole.edges()[i].lo);
      EXPECT_EQ(f.edges()[i].hi, whole.edges()[i].hi);
      EXPECT_EQ(f.edges()[i].curve, whole.edges()[i].curve);
    }
    EXPECT_TRUE(std::equal(f.corners().begin(), f.corners().end(), whole.corners().begin(),
                           whole.corners().end()));
  }
}

TEST(Features, TilesSeeTheirShare) {
  const Surface s = roof(30, 1.0, 0.0);
  TiledScan scan(s, 50);
  build_vertex_graph(scan.store, scan.mesh, scan.tasks);
  const FeatureSet f = find_features(scan.store, scan.mesh, with_side(0.1), scan.tasks);
  std::size_t ends = 0;
  std::size_t corners = 0;
  for (std::uint32_t t = 0; t < scan.mesh.layout.tile_count(); ++t) {
    const TileMesh mesh = load_tile(scan.store, scan.mesh, TileId(t));
    const TileFeatures here = f.of_tile(mesh.extent, mesh.halo_ids.span());
    for (const FeatureMark& m : here.marks) {
      ends += m.neighbors;
      corners += m.corner ? 1 : 0;
      EXPECT_LT(m.vertex, mesh.extent.owned);
      for (const std::uint32_t j : here.neighbors(m)) {
        const std::uint64_t a = mesh.global_id(m.vertex);
        const std::uint64_t b = mesh.global_id(j);
        EXPECT_TRUE(std::any_of(f.edges().begin(), f.edges().end(), [&](const FeatureEdge& e) {
          return e.lo == std::min(a, b) && e.hi == std::max(a, b);
        }));
      }
    }
    for (const auto& [lo, hi] : f.tile_creases(mesh)) {
      EXPECT_NEAR(static_cast<double>(mesh.positions[lo].y()), 0.5, 1e-6);
      EXPECT_NEAR(static_cast<double>(mesh.positions[hi].y()), 0.5, 1e-6);
    }
  }
  EXPECT_EQ(ends, 2 * f.edges().size());
  EXPECT_EQ(corners, f.corners().size());
}

}  // namespace
}  // namespace rattan
