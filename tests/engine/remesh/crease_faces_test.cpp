// SPDX-License-Identifier: MIT
// Faces beside creases, whose vertices can't leave them: no flat corners there.
#include <array>

#include <gtest/gtest.h>

#include "engine/remesh/collapse_quads.h"
#include "engine/remesh/join_triangles.h"
#include "engine/remesh/quality.h"
#include "engine/remesh/split_cells.h"
#include "tests/engine/remesh/shapes.h"

namespace rattan {
namespace {

/// 4 x 4 quads; the middle row of edges is a crease if asked for.
PolygonMesh creased_grid(bool crease) {
  PolygonMesh m = test::grid(4, 4);
  for (std::uint32_t x = 0; crease && x < 4; ++x) {
    m.feature_edges.push_back({10 + x, 11 + x});
  }
  m.vertex_flags.assign(m.vertex_count(), 0);
  for (std::uint32_t x = 0; crease && x <= 4; ++x) {
    m.vertex_flags[10 + x] = kFeatureVertex;
  }
  return m;
}

TEST(CreaseFaces, AVertexOnACreaseKeepsAnEdgeOnEachSide) {
  for (const bool crease : {false, true}) {
    for (const std::uint32_t lowest : {6U, 11U}) {  // below and above the crease
      CellMap map(creased_grid(crease));
      for (const std::array<std::uint32_t, 2>& edge :
           {std::array{lowest, lowest + 1}, std::array{lowest + 1, lowest + 6}}) {
        const std::uint32_t h = map.find_half(edge[0], edge[1]);
        ASSERT_NE(h, CellMap::kNone);
        EXPECT_EQ(collapsible(map, h), !crease) << lowest;
      }
    }
  }
}

TEST(CreaseFaces, TrianglesMergeUnlessThatLeavesAFlatCorner) {
  for (const bool crease : {false, true}) {
    // The edge between the two quads above the crease becomes one between two triangles.
    CellMap map(creased_grid(crease));
    for (const std::array<std::uint32_t, 2>& diagonal :
         {std::array<std::uint32_t, 2>{12, 16}, std::array<std::uint32_t, 2>{12, 18}}) {
      for (std::uint32_t f = 0, faces = map.face_count(); f < faces; ++f) {
        std::vector<std::uint32_t> halves;
        if (!map.is_cell(f) || map.degree(f) != 4) {
          continue;
        }
        map.face_halves(f, halves);
        for (std::size_t k = 0; k < 2; ++k) {
          const std::uint32_t u = map.origin(halves[k]), v = map.origin(halves[k + 2]);
          if ((u == diagonal[0] && v == diagonal[1]) || (v == diagonal[0] && u == diagonal[1])) {
            map.split_face(halves[k], halves[k + 2]);
            break;
          }
        }
      }
    }
    join_triangles(map);
    PolygonMesh joined = map.to_mesh();
    EXPECT_EQ(measure_quality(joined).triangles, 0U);
    EXPECT_EQ(map.counts().euler(), 1);
    for (std::uint32_t f = 0; f < map.face_count(); ++f) {
      if (!map.is_cell(f)) {
        continue;
      }
      std::vector<std::uint32_t> halves;
      map.face_halves(f, halves);
      for (std::size_t k = 0; k < halves.size(); ++k) {
        EXPECT_FALSE(map.is_feature(halves[k]) && map.is_feature(halves[(k + 1) % halves.size()]));
      }
    }
  }
}

TEST(CreaseFaces, FirmVerticesGetTrianglesRatherThanFlatQuads) {
  // A square whose lower side is divided into two and three.
  for (const std::uint32_t parts : {2U, 3U}) {
    PolygonMesh m;
    std::vector<std::uint32_t> face;
    for (std::uint32_t k = 0; k <= parts; ++k) {
      m.positions.emplace_back(static_cast<double>(k) / parts, 0.0, 0.0);
    }
    m.positions.emplace_back(1.0, 1.0, 0.0);
    m.positions.emplace_back(0.0, 1.0, 0.0);
    for (std::uint32_t k = 0; k < m.vertex_count(); ++k) {
      face.push_back(k);
    }
    m.add_face(face);
    CellMap map(std::move(m));
    map.set_normals({});
    std::vector<std::uint32_t> halves;
    std::uint32_t cell = 0;
    while (!map.is_cell(cell)) {
      ++cell;
    }
    map.face_halves(cell, halves);
    PolygonCorners corners;
    gather_corners(map, halves, {}, corners);
    corners.firm.assign(corners.size(), 1);
    PolygonSplitter splitter;
    const PolygonSplit split = splitter.split(corners, false, true);
    ASSERT_TRUE(split.feasible);
    ASSERT_TRUE(apply_split(map, halves, split));
    const MeshQuality q = measure_quality(map.to_mesh());
    EXPECT_EQ(q.triangles, parts - 1);
    EXPECT_EQ(q.quads, 1U);
    EXPECT_GT(q.min_scaled_jacobian, 0.8);
  }
}

}  // namespace
}  // namespace rattan
