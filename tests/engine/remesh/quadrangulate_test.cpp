// SPDX-License-Identifier: MIT
#include "engine/remesh/quadrangulate.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "engine/remesh/mend_quads.h"
#include "engine/remesh/quality.h"
#include "engine/remesh/topology.h"
#include "tests/engine/remesh/small_maps.h"

namespace rattan {
namespace {

using namespace test;

PolygonMesh run(CellComplex cells, QuadrangulateReport& report, QuadrangulateOptions options = {}) {
  return quadrangulate(std::move(cells), options, report);
}

TEST(Quadrangulate, GridsSurviveUnchanged) {
  for (const PolygonMesh& mesh : {grid(5, 4), slab(1), grid(1, 1)}) {
    QuadrangulateReport report;
    EXPECT_EQ(expected_faces(to_complex(mesh)), static_cast<double>(mesh.face_count()));
    const PolygonMesh result = run(to_complex(mesh), report);
    EXPECT_EQ(result.face_count(), mesh.face_count());
    EXPECT_EQ(result.vertex_count(), mesh.vertex_count());
    EXPECT_EQ(measure_quality(result).quads, mesh.face_count());
    EXPECT_EQ(report.clean.contracted_edges + report.clean.joined_edges + report.insets, 0U);
  }
}

TEST(Quadrangulate, HexagonsSplitInTwoQuads) {
  // A row of 2 x 1 cells with nodes in the middle of their long sides.
  CellMap map(grid(8, 3));
  erase_edges(map, [](const Vec3d& p, const Vec3d& q) {
    return p.x() == q.x() && static_cast<int>(p.x()) % 2 == 1;
  });
  Rng rng(1);
  QuadrangulateReport report;
  const PolygonMesh result = run(to_complex(map, rng), report);
  const MeshQuality quality = measure_quality(result);
  EXPECT_EQ(quality.quads, 24U);
  EXPECT_EQ(quality.triangles, 0U);
  EXPECT_NEAR(quality.min_scaled_jacobian, 1.0, 1e-12);
}

TEST(Quadrangulate, TVerticesBecomeConforming) {
  // One line ends in the middle of a grid: its cells go from pairs to wide cells.
  CellMap map(grid(8, 8));
  erase_edges(map, [](const Vec3d& p, const Vec3d& q) {
    return is_upright(p, q, 4, 4) || is_upright(p, q, 4, 5) || is_upright(p, q, 4, 6);
  });
  Rng rng(1);
  const CellMap::Counts before = map.counts();
  QuadrangulateReport report;
  const PolygonMesh result = run(to_complex(map, rng), report);
  expect_kept(before, result);
  EXPECT_LE(measure_quality(result).triangles, 1U);
}

TEST(Quadrangulate, TrianglesAtTheEndsOfAStripVanish) {
  // A row of cells whose two end sides are contracted.
  CellMap map(grid(4, 5));
  contract_edges(map, [](const Vec3d& p, const Vec3d& q) {
    return is_upright(p, q, 0, 2) || is_upright(p, q, 4, 2);
  });
  Rng rng(1);
  QuadrangulateReport report;
  const CellMap::Counts before = map.counts();
  const PolygonMesh result = run(to_complex(map, rng), report);
  expect_kept(before, result);
  EXPECT_EQ(measure_quality(result).triangles, 0U);
  EXPECT_GT(report.triangle_pairs, 0U);
}

TEST(Quadrangulate, ALoneTriangleLeavesThroughTheBoundary) {
  CellMap map(grid(6, 5));
  contract_edges(map, [](const Vec3d& p, const Vec3d& q) { return is_upright(p, q, 0, 2); });
  Rng rng(1);
  const CellMap::Counts before = map.counts();
  QuadrangulateReport report;
  const PolygonMesh result = run(to_complex(map, rng), report);
  expect_kept(before, result);
  EXPECT_EQ(report.border_triangles, 1U);
  EXPECT_EQ(measure_quality(result).triangles, 0U);
  EXPECT_EQ(measure_quality(result).bad_quads, 0U);
  QuadrangulateOptions off;
  off.pair_between = 0;
  EXPECT_EQ(measure_quality(run(to_complex(map, rng), report, off)).triangles, 1U);
}

TEST(Quadrangulate, ContractsShortEdgesButKeepsCorners) {
  PolygonMesh mesh = grid(4, 4);
  mesh.positions[2] = Vec3d(1.1, 0, 0);  // a short boundary edge 1-2
  mesh.positions[12] = Vec3d(2, 1.9, 0);
  mesh.vertex_flags.assign(mesh.vertex_count(), 0);
  mesh.vertex_flags[1] = mesh.vertex_flags[2] = kCornerVertex;
  CellMap map(std::move(mesh));
  QuadrangulateReport report;
  const CellMap::Counts before = map.counts();
  CellComplex cells;
  cells.mesh = map.to_mesh();
  {
    Rng rng(1);
    const CellComplex linked = to_complex(map, rng);
    // Keep this mesh's own numbering: one corner per cell corner, edges by their ends.
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> ids;
    for (std::size_t f = 0; f < cells.mesh.face_count(); ++f) {
      const auto v = cells.mesh.face(f);
      for (std::size_t k = 0; k < v.size(); ++k) {
        const auto key = std::minmax(v[k], v[(k + 1) % v.size()]);
        cells.corner_edge.push_back(
            ids.emplace(key, static_cast<std::uint32_t>(ids.size())).first->second);
      }
    }
    cells.edge_count = static_cast<std::uint32_t>(ids.size());
    ASSERT_EQ(cells.edge_count, linked.edge_count);
  }
  const PolygonMesh result = run(std::move(cells), report);
  expect_kept(before, result);
  std::size_t corners = 0;
  for (std::size_t v = 0; v < result.vertex_count(); ++v) {
    if (result.vertex_flags[v] & kCornerVertex) {
      ++corners;
      EXPECT_TRUE(result.positions[v] == Vec3d(1, 0, 0) || result.positions[v] == Vec3d(1.1, 0, 0));
    }
  }
  EXPECT_EQ(corners, 2U);
}

TEST(Quadrangulate, TinyComponents) {
  using Faces = std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>>;
  struct Case {
    const char* name;
    std::uint32_t vertices, edges;
    Faces faces;
  };
  const std::vector<Case> cases{
      {"sphere of one edge", 2, 1, {{{0, 0}, {1, 0}}}},
      {"sphere of one loop", 1, 1, {{{0, 0}}, {{0, 0}}}},
      {"sphere of a path", 3, 2, {{{0, 0}, {1, 1}, {2, 1}, {1, 0}}}},
      {"two 2-gons", 2, 2, {{{0, 0}, {1, 1}}, {{0, 1}, {1, 0}}}},
      {"two triangles", 3, 3, {{{0, 0}, {1, 1}, {2, 2}}, {{0, 2}, {2, 1}, {1, 0}}}},
      {"pillow", 4, 4, {{{0, 0}, {1, 1}, {2, 2}, {3, 3}}, {{0, 3}, {3, 2}, {2, 1}, {1, 0}}}},
      {"tetrahedron",
       4,
       6,
       {{{0, 0}, {1, 1}, {2, 2}},
        {{0, 3}, {3, 4}, {1, 0}},
        {{1, 4}, {3, 5}, {2, 1}},
        {{2, 5}, {3, 3}, {0, 2}}}},
      {"torus of one vertex", 1, 2, {{{0, 0}, {0, 1}, {0, 0}, {0, 1}}}},
      {"double torus of one vertex",
       1,
       4,
       {{{0, 0}, {0, 1}, {0, 0}, {0, 1}, {0, 2}, {0, 3}, {0, 2}, {0, 3}}}},
      {"disk of one boundary node", 1, 1, {{{0, 0}}}},
      {"disk of two boundary nodes", 2, 2, {{{0, 0}, {1, 1}}}},
      {"disk of three boundary nodes", 3, 3, {{{0, 0}, {1, 1}, {2, 2}}}},
      {"annulus of two loops", 2, 3, {{{0, 0}, {0, 2}, {1, 1}, {1, 2}}}},
      {"two disks", 2, 2, {{{0, 0}}, {{1, 1}}}},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    const CellMap map(complex_of(c.vertices, c.edges, c.faces));
    map.validate();
    for (const double contract : {0.0, 0.3, 5.0}) {
      QuadrangulateReport report;
      QuadrangulateOptions options;
      options.contract_below = contract;
      const PolygonMesh mesh = run(complex_of(c.vertices, c.edges, c.faces), report, options);
      expect_kept(map.counts(), mesh);
      options.pure_quads = true;
      const PolygonMesh pure = run(complex_of(c.vertices, c.edges, c.faces), report, options);
      expect_kept(map.counts(), pure);
      EXPECT_EQ(measure_quality(pure).triangles, 0U);
    }
  }
}

CellMap random_map(Rng& rng, int round) {
  int holes = 0;
  PolygonMesh base;
  switch (round % 6) {
    case 0:
      base = slab(0);
      break;
    case 1:
      base = slab(1);
      break;
    case 2:
      base = join(slab(2), slab(0));
      break;
    case 3:
      base = grid(1 + pick(rng, 6), 1 + pick(rng, 6));
      break;
    case 4:
      base = join(grid(5, 5), grid(2, 1));
      break;
    default:
      base = slab(3);
      break;
  }
  CellMap map(punch(base, static_cast<int>(pick(rng, 4)), rng, holes));
  if (pick(rng, 2) == 0) {
    shake(map, 150, {.erase = 0, .contract = 0, .split_edge = 1, .split_face = 6}, rng);
  }
  FuzzMix mix;
  mix.erase = pick(rng, 6);
  mix.contract = pick(rng, 6);
  mix.split_edge = pick(rng, 3);
  mix.split_face = pick(rng, 3);
  mix.dangle = pick(rng, 4) == 0;
  if (mix.erase + mix.contract + mix.split_edge + mix.split_face + mix.dangle > 0) {
    shake(map, static_cast<int>(pick(rng, 600)), mix, rng);
  }
  return map;
}

TEST(Quadrangulate, RandomComplexesKeepTheirTopology) {
  for (int round = 0; round < 6000; ++round) {
    Rng rng(static_cast<std::uint64_t>(round));
    const CellMap map = random_map(rng, round);
    QuadrangulateOptions options;
    options.contract_below = 0.3 * pick(rng, 4);
    options.pair_between = pick(rng, 6);
    QuadrangulateReport report;
    PolygonMesh mesh = run(to_complex(map, rng), report, options);
    expect_kept(map.counts(), mesh);
    // Positions of such meshes are folded: many quads are bad.
    split_bad_quads(mesh);
    expect_kept(map.counts(), mesh);
    EXPECT_EQ(measure_quality(mesh).bad_quads, 0U);
    ASSERT_FALSE(HasFailure()) << "round " << round;
  }
}

TEST(Quadrangulate, RandomComplexesBecomePureQuads) {
  JoinReport joined;
  std::uint64_t subdivided = 0, collapsed = 0, inset = 0;
  for (int round = 0; round < 4000; ++round) {
    Rng rng(static_cast<std::uint64_t>(round));
    const CellMap map = random_map(rng, round);
    QuadrangulateOptions options;
    options.contract_below = 0.3 * pick(rng, 4);
    options.pair_between = pick(rng, 6);
    options.pure_quads = true;
    QuadrangulateReport report;
    const PolygonMesh mesh = run(to_complex(map, rng), report, options);
    expect_kept(map.counts(), mesh);
    EXPECT_EQ(measure_quality(mesh).triangles, 0U);
    // Positions of such meshes are folded: many quads are bad.
    PolygonMesh mended = mesh;
    for (int times = 0; times < 2; ++times) {
      const MendReport mend = mend_bad_quads(mended);
      collapsed += mend.collapsed;
      inset += mend.inset;
      expect_kept(map.counts(), mended);
      EXPECT_EQ(measure_quality(mended).triangles, 0U);
    }
    joined.merged += report.joined.merged;
    joined.chords += report.joined.chords;
    joined.at_border += report.joined.at_border;
    subdivided += report.subdivided > 0 ? 1 : 0;
    ASSERT_FALSE(HasFailure()) << "round " << round;
  }
  // All means were needed; the last one by tiny components alone.
  EXPECT_GT(joined.merged, 20U);
  EXPECT_GT(joined.chords, 1000U);
  EXPECT_GT(joined.at_border, 100U);
  EXPECT_GT(subdivided, 0U);
  EXPECT_GT(collapsed, 100U);
  EXPECT_GT(inset, 100U);
  EXPECT_LT(subdivided, 1200U);
}

TEST(Quadrangulate, ThreadsDoNotMatter) {
  Rng rng(11);
  CellMap map(grid(60, 60));
  shake(map, 6000, {.erase = 4, .contract = 1, .split_edge = 1, .split_face = 1}, rng);
  const CellComplex cells = to_complex(map, rng);
  std::vector<PolygonMesh> results;
  for (const std::size_t threads : {1, 2, 4}) {
    oneapi::tbb::global_control control(oneapi::tbb::global_control::max_allowed_parallelism,
                                        threads);
    QuadrangulateReport report;
    results.push_back(run(cells, report));
  }
  for (std::size_t i = 1; i < results.size(); ++i) {
    EXPECT_EQ(results[i].corners, results[0].corners);
    EXPECT_EQ(results[i].face_begin, results[0].face_begin);
    EXPECT_EQ(results[i].positions, results[0].positions);
    EXPECT_EQ(results[i].vertex_flags, results[0].vertex_flags);
  }
}

TEST(Quadrangulate, HugeFacesAreDivided) {
  CellMap map(grid(40, 40));
  Rng rng(5);
  // Everything within one cell: 160 corners.
  erase_edges(map, [](const Vec3d&, const Vec3d&) { return true; });
  QuadrangulateReport report;
  CellComplex cells = to_complex(map, rng);
  EXPECT_GE(expected_faces(cells), 79.0);
  const PolygonMesh mesh = run(std::move(cells), report);
  expect_kept(map.counts(), mesh);
  EXPECT_GE(measure_quality(mesh).quad_share, 0.9);
}

TEST(Quadrangulate, CarriesScanTrianglesAndFlags) {
  CellComplex cells = complex_of(2, 2, {{{0, 0}, {1, 1}}});
  cells.mesh.scan_triangle = {17, 23};
  cells.mesh.vertex_flags = {kCornerVertex, 0};
  QuadrangulateReport report;
  const PolygonMesh mesh = run(std::move(cells), report);
  ASSERT_EQ(mesh.scan_triangle.size(), mesh.vertex_count());
  ASSERT_EQ(mesh.vertex_flags.size(), mesh.vertex_count());
  EXPECT_EQ(mesh.vertex_flags[0], kCornerVertex | kBoundaryVertex);
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
    EXPECT_TRUE(mesh.scan_triangle[v] == 17 || mesh.scan_triangle[v] == 23);
    EXPECT_TRUE(mesh.vertex_flags[v] & kBoundaryVertex);
  }
}

TEST(SplitBadQuads, DartsBecomeTwoTrianglesAtTheReflexCorner) {
  PolygonMesh mesh;
  mesh.positions = {Vec3d(0, 0, 0), Vec3d(2, 0, 0), Vec3d(0.5, 0.5, 0), Vec3d(0, 2, 0)};
  mesh.add_face(std::array<std::uint32_t, 4>{0, 1, 2, 3});
  EXPECT_EQ(split_bad_quads(mesh), 1U);
  ASSERT_EQ(mesh.face_count(), 2U);
  for (std::size_t f = 0; f < 2; ++f) {
    const auto v = mesh.face(f);
    EXPECT_EQ(v.size(), 3U);
    EXPECT_EQ(std::count(v.begin(), v.end(), 2U), 1);
    const Vec3d normal = (mesh.positions[v[1]] - mesh.positions[v[0]])
                             .cross(mesh.positions[v[2]] - mesh.positions[v[0]]);
    EXPECT_GT(normal.z(), 0);
  }
  EXPECT_EQ(split_bad_quads(mesh), 0U);
}

TEST(SubdivideToQuads, QuadruplesAGrid) {
  const PolygonMesh fine = subdivide_to_quads(grid(3, 2));
  EXPECT_EQ(fine.face_count(), 24U);
  EXPECT_EQ(fine.vertex_count(), 35U);
  EXPECT_TRUE(check_topology(fine).clean());
  EXPECT_NEAR(measure_quality(fine).min_scaled_jacobian, 1, 1e-12);
}

}  // namespace
}  // namespace rattan
