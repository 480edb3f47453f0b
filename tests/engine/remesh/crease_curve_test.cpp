// SPDX-License-Identifier: MIT
#include "engine/remesh/crease_curve.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "engine/core/memory_store.h"
#include "engine/mesh/ingest.h"
#include "engine/mesh/vertex_graph.h"
#include "tests/engine/remesh/scan_shapes.h"

namespace rattan {
namespace {

constexpr std::uint32_t kCells = 24;

FeatureSet features_of(const std::function<Vec3d(double, double)>& f) {
  MemoryStore store;
  TaskGraph tasks;
  const test::Soup s = test::grid_scan(kCells, kCells, f);
  const ScanMesh mesh = tile_indexed_mesh(store, s.positions, s.triangles, 100);
  build_vertex_graph(store, mesh, tasks);
  FeatureOptions options;
  options.side = 3.0 / kCells;
  return find_features(store, mesh, options, tasks);
}

/// Two narrow parallel folds, one up and one down, across the unit square.
Vec3d step(double u, double v) {
  const double low = 11.0 / kCells;
  const double high = 13.0 / kCells;
  return {u, v, 2.0 * (std::min(std::max(v, low), high) - low)};
}

TEST(CreaseCurve, TheEndsTellTheCurve) {
  const FeatureSet features = features_of(step);
  const CreaseCurve curves(&features);
  ASSERT_FALSE(curves.empty());
  std::array<std::uint32_t, 2> found{};
  for (std::size_t k = 0; k < 2; ++k) {
    const double v = static_cast<double>(static_cast<float>((k == 0 ? 11.0 : 13.0) / kCells));
    const double z = k == 0 ? 0.0 : static_cast<double>(static_cast<float>(4.0 / kCells));
    const Vec3d p(0.0, v, z);
    const Vec3d q(1.0, v, z);
    found[k] = curves.between(p, q);
    ASSERT_NE(found[k], kNoCurve);
    EXPECT_EQ(curves.between(q, p), found[k]);
    for (const double t : {0.0, 0.3, 1.0}) {
      const Vec3d x = p + t * (q - p);
      EXPECT_LT((curves.closest(x, found[k]) - x).norm(), 1e-6);
    }
    EXPECT_EQ(curves.between(p, Vec3d(0.5, v, z)), kNoCurve);
    EXPECT_EQ(curves.between(p, p), kNoCurve);
  }
  EXPECT_NE(found[0], found[1]);
}

TEST(CreaseCurve, ChainsStayOnTheirCurveBesideAnother) {
  const FeatureSet features = features_of(step);
  const CreaseCurve curves(&features);
  // Vertices along the lower fold, all but the ends displaced to beyond the upper one.
  PolygonMesh mesh;
  const double v = static_cast<double>(static_cast<float>(11.0 / kCells));
  constexpr std::uint32_t kParts = 6;
  for (std::uint32_t k = 0; k <= kParts; ++k) {
    const double away = k == 0 || k == kParts ? 0.0 : 3.0 / kCells;
    mesh.positions.emplace_back(double(k) / kParts, v + away, 0.0);
    mesh.vertex_flags.push_back(kFeatureVertex | (away == 0.0 ? kCornerVertex : 0));
    if (k > 0) {
      mesh.feature_edges.push_back({k - 1, k});
    }
  }
  const CreaseVertices at = crease_vertices(mesh, curves);
  const std::uint32_t wanted = curves.between(mesh.positions.front(), mesh.positions.back());
  ASSERT_NE(wanted, kNoCurve);
  for (std::uint32_t k = 1; k < kParts; ++k) {
    EXPECT_EQ(at.degree[k], 2);
    EXPECT_EQ(at.curve[k], wanted) << k;
  }
}

}  // namespace
}  // namespace rattan
