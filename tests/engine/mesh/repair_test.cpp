// SPDX-License-Identifier: MIT
#include "engine/mesh/repair.h"

#include <limits>

#include "engine/mesh/fill_hole.h"
#include "engine/mesh/refine.h"
#include "tests/engine/mesh/ingest_checks.h"

namespace rattan {
namespace {

using namespace testing;

TEST(Repair, RepairsTheSameWhateverTheMemoryAndTheThreads) {
  const Soup s = broken();
  for (const std::uint32_t tile_size : {16U, 100000U}) {
    const auto one = ingest_and_check(s, tile_size);
    EXPECT_GT(one.mesh.repaired.degenerate_triangles, 39U);
    EXPECT_GT(one.mesh.repaired.duplicate_triangles, 70U);
    EXPECT_GT(one.mesh.repaired.non_manifold_edges, 20U);
    EXPECT_GT(one.mesh.repaired.split_vertices, 20U);
    EXPECT_GT(one.mesh.repaired.flipped_triangles, 20U);
    EXPECT_EQ(one.mesh.repaired.isolated_vertices, 40U);
    EXPECT_EQ(one.mesh.repaired.non_finite_vertices, 1U);
    for (const std::uint64_t memory : {1U, 3000U}) {
      IngestOptions tiny;
      tiny.memory_bytes = memory;
      tiny.spool_block_bytes = 100;
      tiny.wide_ids = memory == 1;
      const auto many = ingest_and_check(s, tile_size, tiny, memory == 1 ? 1 : 4);
      EXPECT_EQ(many.whole, one.whole);
      EXPECT_EQ(many.mesh.area, one.mesh.area);
      EXPECT_EQ(many.mesh.mean_edge_length, one.mesh.mean_edge_length);
      EXPECT_EQ(many.mesh.repaired.flipped_triangles, one.mesh.repaired.flipped_triangles);
      EXPECT_EQ(many.mesh.repaired.non_manifold_edges, one.mesh.repaired.non_manifold_edges);
    }
  }
  const auto small = ingest_and_check(s, 16);
  const auto large = ingest_and_check(s, 100000);
  EXPECT_EQ(small.whole, large.whole);
  EXPECT_EQ(small.mesh.repaired.flipped_triangles, large.mesh.repaired.flipped_triangles);
  EXPECT_EQ(small.mesh.repaired.split_vertices, large.mesh.repaired.split_vertices);
  EXPECT_EQ(small.mesh.repaired.non_manifold_edges, large.mesh.repaired.non_manifold_edges);
  EXPECT_EQ(small.mesh.repaired.isolated_vertices, large.mesh.repaired.isolated_vertices);
}

TEST(Repair, TurnedTrianglesFollowTheMajority) {
  Soup s = torus(16, 12);
  const auto straight = geometry(ingest_and_check(s, 20).whole);
  for (std::size_t t = 0; t < s.triangles.size(); t += 3) {
    std::swap(s.triangles[t][0], s.triangles[t][1]);
  }
  for (const std::uint32_t size : {20U, 1000U}) {
    const auto turned = ingest_and_check(s, size);
    EXPECT_EQ(turned.mesh.repaired.flipped_triangles, (s.triangles.size() + 2) / 3);
    EXPECT_EQ(turned.mesh.repaired.non_manifold_edges, 0U);
    EXPECT_EQ(turned.mesh.topology.euler(), 0);
    EXPECT_EQ(geometry(turned.whole), straight);
  }
}

TEST(Repair, AMoebiusStripIsCutOnce) {
  constexpr std::uint32_t kAround = 24;
  constexpr std::uint32_t kAcross = 3;
  Soup s;
  for (std::uint32_t u = 0; u < kAround; ++u) {
    for (std::uint32_t v = 0; v <= kAcross; ++v) {
      const double a = 2 * 3.14159265358979 * u / kAround;
      const double w = 0.4 * (v - 1.5);
      const double r = 2 + w * std::cos(a / 2);
      s.add(r * std::cos(a), r * std::sin(a), w * std::sin(a / 2));
    }
  }
  const auto id = [&](std::uint32_t u, std::uint32_t v) -> std::uint64_t {
    return u < kAround ? u * (kAcross + 1) + v : kAcross - v;
  };
  for (std::uint32_t u = 0; u < kAround; ++u) {
    for (std::uint32_t v = 0; v < kAcross; ++v) {
      s.quad(id(u, v), id(u + 1, v), id(u + 1, v + 1), id(u, v + 1));
    }
  }
  for (const std::uint32_t size : {8U, 30U, 1000U}) {
    const auto m = ingest_and_check(s, size).mesh;
    EXPECT_EQ(m.repaired.flipped_triangles, 0U);
    EXPECT_EQ(m.repaired.non_manifold_edges, kAcross);
    EXPECT_EQ(m.repaired.split_vertices, kAcross + 1);
    EXPECT_EQ(m.topology.components, 1U);
    EXPECT_EQ(m.topology.boundary_loops, 1U);
    EXPECT_EQ(m.topology.euler(), 1);
  }
}

TEST(Repair, ThreePagesOfABookComeApart) {
  Soup s;
  const auto a = s.add(0, 0, 0);
  const auto b = s.add(0, 0, 1);
  for (int k = 0; k < 3; ++k) {
    s.triangles.push_back({a, b, s.add(std::cos(2.0 * k), std::sin(2.0 * k), 0.5)});
  }
  for (const std::uint32_t size : {1U, 2U, 100U}) {
    const auto m = ingest_and_check(s, size).mesh;
    EXPECT_EQ(m.repaired.non_manifold_edges, 1U);
    EXPECT_EQ(m.repaired.split_vertices, 4U);
    EXPECT_EQ(m.topology.components, 3U);
    EXPECT_EQ(m.topology.vertices, 9U);
  }
}

TEST(Repair, AFinLeavesTheSurfaceClosed) {
  Soup s = torus(12, 8);
  const std::uint64_t apex = s.add(0, 0, 9);
  s.triangles.push_back({s.triangles[10][0], s.triangles[10][1], apex});
  for (const std::uint32_t size : {5U, 1000U}) {
    const auto m = ingest_and_check(s, size).mesh;
    EXPECT_EQ(m.topology.components, 2U);
    EXPECT_EQ(m.topology.boundary_loops, 1U);
    EXPECT_EQ(m.topology.euler(), 1);
    EXPECT_EQ(m.repaired.split_vertices, 2U);
  }
}

TEST(Repair, ConesThatShareAnApexGetTheirOwn) {
  Soup s;
  const auto apex = s.add(0, 0, 0);
  constexpr std::uint32_t kSides = 20;  // more than the fast path for fans takes
  for (const double z : {-1.0, 1.0}) {
    const std::uint64_t first = s.positions.size();
    for (std::uint32_t k = 0; k < kSides; ++k) {
      s.add(std::cos(0.1 * k), std::sin(0.1 * k), z);
    }
    for (std::uint32_t k = 0; k < kSides; ++k) {
      s.triangles.push_back({apex, first + k, first + (k + 1) % kSides});
    }
  }
  for (const std::uint32_t size : {4U, 1000U}) {
    const auto m = ingest_and_check(s, size).mesh;
    EXPECT_EQ(m.repaired.split_vertices, 1U);
    EXPECT_EQ(m.topology.components, 2U);
    EXPECT_EQ(m.topology.boundary_loops, 2U);
    EXPECT_EQ(m.topology.euler(), 2);
  }
}

TEST(Repair, ZeroAreaTrianglesStay) {
  Soup s;
  s.add(0, 0, 0);
  s.add(1, 0, 0);
  s.add(2, 0, 0);
  s.triangles.push_back({0, 1, 2});
  EXPECT_EQ(ingest_and_check(s).mesh.topology.triangles, 1U);
}

/// Every triangle with corners of its own.
Soup exploded(const Soup& soup) {
  Soup s;
  for (const Corner3& t : soup.triangles) {
    const std::uint64_t n = s.positions.size();
    for (const std::uint64_t v : t) {
      s.positions.push_back(soup.positions[v]);
    }
    s.triangles.push_back({n, n + 1, n + 2});
  }
  return s;
}

TEST(Repair, SoupIsMergedAtEqualPositions) {
  const Soup whole = joined(torus(20, 14), grid(9, 9, false, false), Vec3d(6, 0.5, 0.25));
  const Soup soup = shuffled(exploded(whole), 9);
  const auto expected = ingest_and_check(whole, 40);
  for (const std::uint32_t size : {40U, 100000U}) {
    const auto one = ingest_and_check(soup, size);
    EXPECT_EQ(geometry(one.whole), geometry(expected.whole));
    EXPECT_EQ(one.mesh.topology.vertices, expected.mesh.topology.vertices);
    EXPECT_EQ(one.mesh.topology.euler(), expected.mesh.topology.euler());
    EXPECT_EQ(one.mesh.repaired.triangle_soup, 1U);
    EXPECT_EQ(one.mesh.repaired.merged_vertices, soup.positions.size() - whole.positions.size());
    EXPECT_EQ(one.mesh.repaired.isolated_vertices, 0U);
    EXPECT_EQ(one.mesh.repaired.split_vertices, 0U);
    for (const std::uint64_t memory : {1U, 3000U}) {
      IngestOptions tiny;
      tiny.memory_bytes = memory;
      tiny.spool_block_bytes = 100;
      tiny.wide_ids = memory == 1;
      EXPECT_EQ(ingest_and_check(soup, size, tiny, memory == 1 ? 1 : 4).whole, one.whole);
    }
  }
}

TEST(Repair, AScanTinyWithinItsBoxIsMergedToo) {
  // All but one triangle in one cell of the curve, more than the buffers hold.
  Soup far;
  far.add(1e9, 0, 0);
  far.add(1e9, 1e9, 0);
  far.add(1e9, 0, 1e9);
  far.triangles.push_back({0, 1, 2});
  const Soup whole = joined(far, torus(12, 8), Vec3d(0, 0, 0));
  const Soup soup = exploded(whole);
  const auto one = ingest_and_check(soup, 30);
  EXPECT_EQ(one.mesh.topology.vertices, whole.positions.size());
  EXPECT_EQ(one.mesh.topology.components, 2U);
  IngestOptions tiny;
  tiny.memory_bytes = 2000;
  EXPECT_EQ(ingest_and_check(soup, 30, tiny).whole, one.whole);
}

TEST(Repair, VerticesOfAMeshAreMergedOnRequestOnly) {
  // A tube whose seam is two rows of vertices.
  Soup s = grid(16, 5, false, false);
  for (Vec3d& p : s.positions) {
    const double a = 2 * 3.14159265358979 * (p[0] == 16 ? 0 : p[0]) / 16;
    p = Vec3d(std::cos(a), std::sin(a), p[1]);
  }
  s.triangles.push_back({0, 16 * 6, 1});  // repeats a vertex once merged
  EXPECT_EQ(ingest_and_check(s, 20).mesh.repaired.merged_vertices, 0U);
  EXPECT_EQ(ingest_and_check(s, 20).mesh.repaired.degenerate_triangles, 0U);
  IngestOptions merge;
  merge.merge = Merge::kAlways;
  const auto m = ingest_and_check(s, 20, merge).mesh;
  EXPECT_EQ(m.repaired.merged_vertices, 6U);
  EXPECT_EQ(m.repaired.degenerate_triangles, 1U);
  EXPECT_EQ(m.repaired.triangle_soup, 0U);
  EXPECT_EQ(m.topology.boundary_loops, 2U);
  EXPECT_EQ(m.topology.euler(), 0);
}

TEST(Repair, NonFiniteVerticesTakeTheirTrianglesWithThem) {
  Soup s = torus(12, 8);
  s.positions[20][1] = std::numeric_limits<double>::infinity();
  s.positions[50][2] = 1e200;  // its square is not finite
  s.triangles.push_back({20, 50, 20});
  const auto m = ingest_and_check(s, 20).mesh;
  EXPECT_EQ(m.repaired.non_finite_vertices, 2U);
  EXPECT_EQ(m.repaired.non_finite_triangles, 12U);
  EXPECT_EQ(m.repaired.degenerate_triangles, 1U);
  EXPECT_EQ(m.topology.boundary_loops, 2U);
}

TEST(Repair, AStrayVertexCostsNoAccuracy) {
  Soup s = grid(20, 20, false, false);
  for (Vec3d& p : s.positions) {
    p = p * 0.01 + Vec3d(4.5e6, 5.5e6, 120);
  }
  s.add(0, 0, 0);
  const auto m = ingest_and_check(s, 50).mesh;
  EXPECT_GT(m.origin[0], 4.4e6);
  EXPECT_EQ(m.repaired.isolated_vertices, 1U);
}

TEST(Repair, ExtremeSizesGetAUnit) {
  for (const double size : {1e30, 1e-30, 1e140, 1e-140}) {
    Soup s = torus(12, 8);
    for (Vec3d& p : s.positions) {
      p *= size;
    }
    const auto m = ingest_and_check(s, 20).mesh;
    EXPECT_GT(m.diagonal(), 0.5);
    EXPECT_LT(m.diagonal(), 4.0);
    EXPECT_NEAR(m.diagonal() * m.unit / size, std::sqrt(64.0 + 64.0 + 4.0), 0.5);
    EXPECT_EQ(m.topology.euler(), 0);
  }
  EXPECT_EQ(ingest_and_check(torus(12, 8), 20).mesh.unit, 1.0);
}

/// A torus without some of its triangles: holes of 3, 4 and many edges.
Soup holed() {
  Soup s = torus(40, 30);
  std::vector<Corner3> kept;
  for (std::size_t t = 0; t < s.triangles.size(); ++t) {
    const std::size_t u = t / 60;
    const std::size_t v = t % 60 / 2;
    const bool large = u >= 20 && u < 30 && v >= 5 && v < 20;
    if (t != 100 && t != 400 && t != 401 && !large) {
      kept.push_back(s.triangles[t]);
    }
  }
  s.triangles = kept;
  return s;
}

TEST(Repair, HolesAreFilledUpToASize) {
  const Soup s = holed();
  EXPECT_EQ(ingest_and_check(s, 50).mesh.topology.boundary_loops, 3U);
  IngestOptions three;
  three.fill_holes = 3;
  EXPECT_EQ(ingest_and_check(s, 50, three).mesh.topology.boundary_loops, 2U);
  for (const std::uint64_t most : {50U, 49U}) {
    IngestOptions fill;
    fill.fill_holes = most;
    const auto one = ingest_and_check(s, 100000, fill);
    EXPECT_EQ(one.mesh.topology.boundary_loops, most == 50 ? 0U : 1U);
    EXPECT_EQ(one.mesh.topology.euler(), most == 50 ? 0 : -1);
    EXPECT_EQ(one.mesh.repaired.filled_holes, most == 50 ? 3U : 2U);
    EXPECT_EQ(one.mesh.repaired.filled_triangles, most == 50 ? 1U + 2U + 48U : 1U + 2U);
    for (const std::uint32_t size : {16U, 70U}) {
      IngestOptions tiny = fill;
      tiny.memory_bytes = 2000;
      const auto many = ingest_and_check(s, size, tiny);
      EXPECT_EQ(many.whole, one.whole);
      EXPECT_EQ(many.mesh.repaired.filled_triangles, one.mesh.repaired.filled_triangles);
    }
  }
}

TEST(Repair, AFilledHoleNeverDoublesAnEdge) {
  IngestOptions fill;
  fill.fill_holes = 10;
  // Two triangles: the hole takes the other diagonal, which makes a tetrahedron.
  Soup s;
  for (int k = 0; k < 4; ++k) {
    s.add(k == 1, k == 2, k == 3);
  }
  s.triangles = {{0, 1, 2}, {0, 2, 3}};
  const auto closed = ingest_and_check(s, 2, fill).mesh;
  EXPECT_EQ(closed.topology.euler(), 2);
  EXPECT_EQ(closed.topology.triangles, 4U);
  // The torus of seven vertices has an edge between any two; without one of them the hole has no
  // free chord, so it gets a vertex.
  Soup seven;
  for (std::uint64_t i = 0; i < 7; ++i) {
    seven.add(std::cos(0.9 * i), std::sin(0.9 * i), 0.1 * i * i);
    for (const Corner3 t : {Corner3{i, (i + 1) % 7, (i + 3) % 7}, {i, (i + 3) % 7, (i + 2) % 7}}) {
      if (t[0] != 6 && t[1] != 6 && t[2] != 6) {
        seven.triangles.push_back(t);
      }
    }
  }
  const auto torus_again = ingest_and_check(seven, 2, fill).mesh;
  EXPECT_EQ(torus_again.topology.euler(), 0);
  EXPECT_EQ(torus_again.topology.vertices, 7U);
  EXPECT_EQ(torus_again.topology.boundary_loops, 0U);
  EXPECT_EQ(torus_again.repaired.filled_triangles, 6U);
  // A belt of three quads has two holes of three corners each.
  Soup belt = grid(3, 1, true, false);
  const auto prism = ingest_and_check(belt, 2, fill).mesh;
  EXPECT_EQ(prism.topology.euler(), 2);
  EXPECT_EQ(prism.repaired.filled_holes, 2U);
  // A lone triangle is no hole.
  Soup lone;
  lone.add(0, 0, 0);
  lone.add(1, 0, 0);
  lone.add(0, 1, 0);
  lone.triangles = {{0, 1, 2}};
  EXPECT_EQ(ingest_and_check(lone, 2, fill).mesh.topology.boundary_loops, 1U);
}

TEST(Repair, SmallComponentsAreDroppedOnRequest) {
  Soup s = joined(torus(20, 14), grid(4, 3, false, false), Vec3d(6, 0, 0));
  s = joined(s, grid(1, 1, false, false), Vec3d(-9, 0, 0));
  s = joined(s, grid(4, 3, false, false), Vec3d(0, 9, 0));
  for (const std::uint32_t size : {1U, 16U, 100000U}) {
    IngestOptions drop;
    drop.drop_components = 25;
    const auto one = ingest_and_check(s, size, drop);
    EXPECT_EQ(one.mesh.topology.components, 1U);
    EXPECT_EQ(one.mesh.repaired.dropped_components, 3U);
    EXPECT_EQ(one.mesh.repaired.dropped_triangles, 50U);
    EXPECT_EQ(geometry(one.whole), geometry(ingest_and_check(torus(20, 14)).whole));
    drop.drop_components = 24;
    drop.fill_holes = 14;
    const auto both = ingest_and_check(s, size, drop).mesh;
    EXPECT_EQ(both.topology.components, 3U);
    EXPECT_EQ(both.topology.boundary_loops, 0U);
    EXPECT_EQ(both.repaired.dropped_components, 1U);
    EXPECT_EQ(both.repaired.filled_holes, 2U);
    drop.drop_components = 1000;
    EXPECT_THROW(ingest_and_check(s, size, drop), InputError);
  }
}

Rgba colour_at(const Vec3d& p) {
  Rgba c;
  for (int k = 0; k < 3; ++k) {
    c[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(std::floor(100.0 + 20.0 * p[k]));
  }
  c[3] = static_cast<std::uint8_t>(200 + std::floor(10.0 * p[2]));
  return c;
}

TEST(Repair, ColoursStayWithTheirVertices) {
  for (const bool as_soup : {false, true}) {
    for (const std::uint32_t size : {16U, 100000U}) {
      Soup s = as_soup ? exploded(holed()) : holed();
      if (!as_soup) {
        s.triangles.push_back({0, 1, 300});  // splits vertices
      }
      MemoryStore store;
      IngestOptions options;
      options.tile_size = size;
      options.memory_bytes = 3000;
      options.fill_holes = 4;
      Ingest in(store, options);
      std::vector<Rgba> colours;
      for (Vec3d& p : s.positions) {
        p = p.cast<float>().cast<double>();
        colours.push_back(colour_at(p));
      }
      const std::size_t half = s.positions.size() / 2;
      in.add_vertices(std::span(s.positions).first(half));
      in.add_colours(std::span(colours).first(half));
      in.add_vertices(std::span(s.positions).subspan(half));
      in.add_colours(std::span(colours).subspan(half));
      in.add_triangles(s.triangles);
      TaskGraph graph;
      const ScanMesh mesh = in.finish(graph);
      ASSERT_TRUE(mesh.has_colours);
      std::size_t checked = 0;
      for (std::uint32_t t = 0; t < mesh.layout.tile_count(); ++t) {
        const TileMesh tile = load_tile(store, mesh, TileId(t));
        const auto tints = read(store, fields::kColour, TileId(t));
        ASSERT_EQ(tints.size(), tile.local_vertices());
        for (std::uint32_t v = 0; v < tile.local_vertices(); ++v) {
          const Vec3d p = tile.positions[v].cast<double>() + mesh.origin;
          EXPECT_EQ(tints[v], colour_at(p));
          ++checked;
        }
      }
      EXPECT_GE(checked, mesh.topology.vertices);
    }
  }
}

TEST(Repair, VerticesBeforeTheFirstColourAreWhite) {
  MemoryStore store;
  Ingest in(store);
  const Soup s = grid(3, 3, false, false);
  in.add_vertices(std::span(s.positions).first(10));
  in.add_vertices(std::span(s.positions).subspan(10, 1));
  in.add_colours(std::vector<Rgba>{{1, 2, 3, 4}});
  in.add_vertices(std::span(s.positions).subspan(11));
  in.add_triangles(s.triangles);
  TaskGraph graph;
  const ScanMesh mesh = in.finish(graph);
  const auto tints = read(store, fields::kColour, TileId(0));
  EXPECT_EQ(std::count(tints.begin(), tints.end(), Rgba{1, 2, 3, 4}), 1);
  EXPECT_EQ(std::count(tints.begin(), tints.end(), Rgba{255, 255, 255, 255}), 15);
}

/// Area of the triangles, each of which must have three different corners.
double area_of(const std::vector<Vec3d>& loop,
               const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  double area = 0;
  for (const auto& t : triangles) {
    EXPECT_LT(t[0], t[1]);
    EXPECT_LT(t[1], t[2]);
    area += 0.5 * (loop[t[1]] - loop[t[0]]).cross(loop[t[2]] - loop[t[0]]).norm();
  }
  return area;
}

TEST(FillHole, ConvexLoopsGetTheirArea) {
  for (const std::uint32_t n : {3U, 4U, 7U, 96U, 97U, 500U}) {
    std::vector<Vec3d> loop;
    for (std::uint32_t i = 0; i < n; ++i) {
      const double a = 2 * 3.14159265358979 * i / n;
      loop.emplace_back(std::cos(a), std::sin(a), 0);
    }
    const auto triangles = triangulate_hole(loop, {});
    ASSERT_EQ(triangles.size(), n - 2);
    EXPECT_NEAR(area_of(loop, triangles), 0.5 * n * std::sin(2 * 3.14159265358979 / n), 1e-9);
  }
}

TEST(FillHole, ForbiddenChordsAreAvoided) {
  std::vector<Vec3d> loop;
  for (int i = 0; i < 5; ++i) {
    loop.emplace_back(std::cos(1.2566 * i), std::sin(1.2566 * i), 0);
  }
  using Chords = std::vector<std::pair<std::uint32_t, std::uint32_t>>;
  const Chords three = {{0, 2}, {0, 3}, {1, 3}};
  const std::vector<std::array<std::uint32_t, 3>> expected = {};
  // What is left, 1 4 and 2 4, is a fan around 4.
  EXPECT_EQ(triangulate_hole(loop, three).size(), 3U);
  const Chords four = {{0, 2}, {0, 3}, {1, 3}, {1, 4}};
  EXPECT_EQ(triangulate_hole(loop, four), expected);
  const Chords large = {{0, 1}, {0, 2}};  // a side may be among them
  EXPECT_EQ(triangulate_hole(loop, large).size(), 3U);
}

}  // namespace
}  // namespace rattan
