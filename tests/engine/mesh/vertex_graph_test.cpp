// SPDX-License-Identifier: MIT
#include "engine/mesh/vertex_graph.h"

#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "tests/engine/mesh/test_surfaces.h"

namespace rattan {
namespace {

using testing::bytes_of;
using testing::Surface;
using testing::TiledScan;

// Writes weights of the original positions for all tiles.
std::vector<float> weights_of(TiledScan& scan, EdgeEnergy energy,
                              std::vector<float>* sums = nullptr) {
  std::vector<float> all;
  for (std::uint32_t t = 0; t < scan.mesh.layout.tile_count(); ++t) {
    FanView fans;
    fans.load(scan.store, TileId(t));
    const ChunkView<Vec3f> p = read(scan.store, fields::kPosition, TileId(t));
    std::vector<float> w;
    std::vector<float> d;
    fan_weights(fans, p.span(), energy, w, d);
    all.insert(all.end(), w.begin(), w.end());
    if (sums != nullptr) {
      sums->insert(sums->end(), d.begin(), d.end());
    }
  }
  return all;
}

TEST(VertexGraph, RowsAreFansOfTheTriangles) {
  for (const Surface& s : {testing::plane(7, 5, 1.0, 1.0), testing::torus(12, 9, 2.0, 0.7),
                           testing::slab_with_holes(2, 2)}) {
    TiledScan scan(s, 13);
    build_vertex_graph(scan.store, scan.mesh, scan.tasks);
    const auto rows = scan.global_rows();
    const auto neighbors = scan.global_neighbors();
    const auto flags = scan.all(fields::kVertexFlag);
    std::set<std::array<std::uint64_t, 3>> expected;
    for (auto t : s.triangles) {
      std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
      expected.insert({t[0], t[1], t[2]});
    }
    std::map<std::array<std::uint64_t, 3>, int> seen;
    for (std::uint64_t i = 0; i + 1 < rows.size(); ++i) {
      const std::uint64_t d = rows[i + 1] - rows[i];
      const bool open = (flags[i] & kOnBoundary) != 0;
      for (std::uint64_t k = 0; k + (open ? 1 : 0) < d; ++k) {
        std::array<std::uint64_t, 3> t = {i, neighbors[rows[i] + k],
                                          neighbors[rows[i] + (k + 1) % d]};
        std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
        ++seen[t];
      }
    }
    EXPECT_EQ(seen.size(), expected.size());
    for (const auto& [t, count] : seen) {
      EXPECT_EQ(count, 3);
      EXPECT_TRUE(expected.contains(t));
    }
  }
}

TEST(VertexGraph, LongFansAreChainedToo) {
  // A cone of 100 triangles around vertex 0, given in shuffled order.
  Surface s;
  s.positions.push_back(Vec3d(0, 0, 1));
  for (int i = 0; i < 100; ++i) {
    s.positions.push_back(Vec3d(std::cos(i * 0.0628), std::sin(i * 0.0628), 0));
  }
  for (std::uint32_t i = 0; i < 99; ++i) {
    const std::uint32_t k = i * 37 % 99;
    s.triangles.push_back({0, 1 + k, 2 + k});
  }
  TiledScan scan(s, 1000);
  build_vertex_graph(scan.store, scan.mesh, scan.tasks);
  const auto neighbors = scan.global_neighbors();
  for (std::uint64_t k = 0; k < 100; ++k) {
    EXPECT_EQ(neighbors[k], k + 1);
  }
}

TEST(VertexGraph, WeightsAreSymmetricToTheLastBitAndTheSameForAllTileSizes) {
  const Surface s = testing::jittered(testing::torus(40, 25, 2.0, 0.7), 0.08);
  std::string first_weights;
  std::string first_neighbors;
  for (const std::uint32_t tile : {17U, 100U, 5000U}) {
    TiledScan scan(s, tile);
    build_vertex_graph(scan.store, scan.mesh, scan.tasks);
    std::vector<float> sums;
    const std::vector<float> w = weights_of(scan, EdgeEnergy::kTriangle, &sums);
    const auto rows = scan.global_rows();
    const auto neighbors = scan.global_neighbors();
    std::map<std::pair<std::uint64_t, std::uint64_t>, float> by_edge;
    for (std::uint64_t i = 0; i + 1 < rows.size(); ++i) {
      double sum = 0.0;
      for (std::uint64_t k = rows[i]; k < rows[i + 1]; ++k) {
        by_edge[{i, neighbors[k]}] = w[k];
        sum += static_cast<double>(w[k]);
      }
      EXPECT_EQ(static_cast<float>(sum), sums[i]);
    }
    for (const auto& [edge, weight] : by_edge) {
      EXPECT_EQ(weight, (by_edge.at({edge.second, edge.first})));
      EXPECT_GE(weight, static_cast<float>(kLowestWeight));
    }
    if (first_weights.empty()) {
      first_weights = bytes_of(w);
      first_neighbors = bytes_of(neighbors);
    } else {
      EXPECT_TRUE(first_weights == bytes_of(w));
      EXPECT_TRUE(first_neighbors == bytes_of(neighbors));
    }
  }
}

TEST(VertexGraph, DirichletEnergyOfALinearFunctionIsItsGradient) {
  // Acute triangulation, so that no weight is clamped: sum_e w |f_i - f_j|^2 = |grad f|^2 area.
  const double h = std::sqrt(0.75);
  const Surface s = testing::grid_surface(
      20, 20, false, false,
      [&](double u, double v) { return Vec3d(20 * u + 10 * v - 4 * v, 20 * h * v, 0.0); },
      [](std::uint32_t, std::uint32_t) { return false; });
  TiledScan scan(s, 77);
  build_vertex_graph(scan.store, scan.mesh, scan.tasks);
  const std::vector<float> w = weights_of(scan, EdgeEnergy::kTriangle);
  const auto rows = scan.global_rows();
  const auto neighbors = scan.global_neighbors();
  double energy = 0.0;
  for (std::uint64_t i = 0; i + 1 < rows.size(); ++i) {
    for (std::uint64_t k = rows[i]; k < rows[i + 1]; ++k) {
      const Vec3d e = s.positions[neighbors[k]] - s.positions[i];
      const double df = Vec3d(0.6, 0.8, 0.0).dot(e);
      energy += 0.5 * static_cast<double>(w[k]) * df * df;
    }
  }
  EXPECT_NEAR(energy, scan.mesh.area, 1e-5 * scan.mesh.area);
}

TEST(VertexGraph, DegenerateTrianglesGiveFiniteBoundedWeights) {
  Surface s = testing::plane(6, 6, 1.0, 1.0);
  s.positions[8] = s.positions[9];                              // an edge without length
  s.positions[16] = 0.5 * (s.positions[15] + s.positions[17]);  // triangles without area
  s.positions[24] = s.positions[25] = s.positions[31] = s.positions[32];
  TiledScan scan(s, 20);
  build_vertex_graph(scan.store, scan.mesh, scan.tasks);
  for (const EdgeEnergy energy : {EdgeEnergy::kTriangle, EdgeEnergy::kEdge}) {
    for (const float w : weights_of(scan, energy)) {
      EXPECT_TRUE(std::isfinite(w));
      EXPECT_GE(w, static_cast<float>(kLowestWeight));
      EXPECT_LE(w, static_cast<float>(kHighestWeight));
    }
  }
}

TEST(VertexGraph, UniformWeightsCountTriangles) {
  TiledScan scan(testing::plane(4, 4, 1.0, 2.0), 9);
  build_vertex_graph(scan.store, scan.mesh, scan.tasks);
  double sum = 0.0;
  for (const float w : weights_of(scan, EdgeEnergy::kEdge)) {
    sum += static_cast<double>(w);
  }
  EXPECT_NEAR(sum, 2 * 3 * 32 * kUniformWeight, 1e-4);
}

}  // namespace
}  // namespace rattan
