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

/// Two folds: a straight one along v = 0.25, and one along v = 0.75 whose every other vertex lies
/// beside that.
Surface straight_and_ragged(std::uint32_t n) {
  return testing::grid_surface(n, n, false, false, [=](double u, double v) {
    const auto column = std::lround(u * n);
    const double jag = std::lround(v * n) == 3 * n / 4 && column % 2 == 1 ? 0.35 / n : 0.0;
    return Vec3d(u, v + jag, std::abs(v - 0.25) - std::max(0.0, 2.0 * (v - 0.75)));
  });
}

struct Ragged {
  std::size_t edges = 0, corners = 0;
};

/// Checks that all that is ragged lies on the second fold.
Ragged ragged_of(const FeatureSet& f) {
  Ragged r;
  for (const FeatureEdge& e : f.edges()) {
    if (e.ragged) {
      ++r.edges;
      EXPECT_FALSE(e.boundary);
      EXPECT_GT(e.p_lo.y(), 0.7F);
    }
    for (const auto& [id, p] : {std::pair(e.lo, e.p_lo), std::pair(e.hi, e.p_hi)}) {
      r.corners += e.ragged && f.is_corner(id) && p.x() > 0.0F && p.x() < 1.0F ? 1 : 0;
    }
  }
  return r;
}

TEST(Features, RaggedCurvesComeWithClearOnes) {
  const std::uint32_t n = 24;
  const Surface s = straight_and_ragged(n);
  FeatureOptions options = with_side(3.0 / n);
  options.tolerance = 1.0 / n;
  const FeatureSet coarse = features_of(s, options);
  EXPECT_TRUE(coarse.has_clear_edges());
  EXPECT_EQ(coarse.crease_edges(), 2 * n);
  EXPECT_EQ(ragged_of(coarse).edges, n);
  EXPECT_EQ(ragged_of(coarse).corners, 0U);
  // Corners wherever the chords would leave the curve.
  options.tolerance = 0.1 / n;
  const FeatureSet fine = features_of(s, options);
  EXPECT_EQ(ragged_of(fine).edges, n);
  EXPECT_EQ(ragged_of(fine).corners, 2 * (n - 1));
  for (const std::uint32_t tile : {37U, 100000U}) {
    const FeatureSet f = features_of(s, options, tile);
    ASSERT_EQ(f.edges().size(), fine.edges().size());
    for (std::size_t i = 0; i < f.edges().size(); ++i) {
      EXPECT_EQ(f.edges()[i].ragged, fine.edges()[i].ragged);
      EXPECT_EQ(f.edges()[i].curve, fine.edges()[i].curve);
    }
  }
  // Without room for them the clear ones stay alone.
  options.most_corners = 0;
  const FeatureSet few = features_of(s, options);
  EXPECT_TRUE(few.has_clear_edges());
  EXPECT_EQ(few.crease_edges(), n);
  EXPECT_EQ(ragged_of(few).edges, 0U);
}

TEST(Features, LinesDontFollowRaggedCurves) {
  const std::uint32_t n = 24;
  TiledScan scan(straight_and_ragged(n), 50);
  build_vertex_graph(scan.store, scan.mesh, scan.tasks);
  const FeatureSet f = find_features(scan.store, scan.mesh, with_side(3.0 / n), scan.tasks);
  std::size_t creases = 0;
  for (std::uint32_t t = 0; t < scan.mesh.layout.tile_count(); ++t) {
    const TileMesh mesh = load_tile(scan.store, scan.mesh, TileId(t));
    const TileFeatures here = f.of_tile(mesh.extent, mesh.halo_ids.span());
    for (const FeatureMark& m : here.marks) {
      const Vec3f& p = mesh.positions[m.vertex];
      EXPECT_FALSE(p.y() > 0.7F && p.y() < 0.8F && p.x() > 0.0F && p.x() < 1.0F);
    }
    for (const auto& [lo, hi] : f.tile_creases(mesh)) {
      creases += mesh.positions[lo].y() > 0.7F ? 1 : 0;
    }
  }
  EXPECT_GE(creases, n);
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
