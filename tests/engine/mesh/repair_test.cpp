// SPDX-License-Identifier: MIT
#include "engine/mesh/repair.h"

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

}  // namespace
}  // namespace rattan
