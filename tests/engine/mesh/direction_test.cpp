// SPDX-License-Identifier: MIT
//
// Directions given in the file's order must arrive at the vertices they were meant for.
#include "tests/engine/mesh/ingest_checks.h"

namespace rattan {
namespace {

using namespace testing;

/// Tells the vertex by its position, which ingest keeps to the last bit of 32.
VertexDirection direction_of(const Vec3d& p) {
  VertexDirection d;
  d.direction = p.cast<float>();
  d.fidelity = static_cast<float>(0.5 + 0.1 * p[2]);
  return d;
}

ScanMesh ingest_directed(Store& store, const Soup& soup, const IngestOptions& options) {
  Ingest in(store, options);
  in.add_vertices(soup.positions);
  in.add_triangles(soup.triangles);
  std::vector<VertexDirection> directions;
  for (const Vec3d& p : soup.positions) {
    directions.push_back(direction_of(p));
  }
  const std::size_t half = directions.size() / 3;
  in.add_directions(std::span(directions).first(half));
  in.add_directions(std::span(directions).subspan(half));
  TaskGraph graph({.threads = 2});
  return in.finish(graph);
}

/// Returns how many vertices have their own direction; the others must have none.
std::uint64_t count_directed(const Soup& soup, const IngestOptions& options) {
  MemoryStore store;
  const ScanMesh mesh = ingest_directed(store, soup, options);
  EXPECT_TRUE(has_wanted_directions(store));
  EXPECT_EQ(mesh.origin, Vec3d(0, 0, 0));
  std::uint64_t directed = 0;
  for (std::uint32_t t = 0; t < mesh.layout.tile_count(); ++t) {
    const auto positions = read(store, fields::kPosition, TileId(t));
    const auto wanted = read(store, fields::kWantedDirection, TileId(t));
    EXPECT_EQ(wanted.size(), mesh.layout.tiles[t].owned);
    for (std::uint32_t v = 0; v < wanted.size(); ++v) {
      if (wanted[v].direction == Vec3f::Zero()) {
        continue;
      }
      const VertexDirection expected = direction_of(positions[v].cast<double>());
      EXPECT_EQ(wanted[v].direction, expected.direction);
      EXPECT_NEAR(wanted[v].fidelity, expected.fidelity, 1e-6);
      ++directed;
    }
  }
  return directed;
}

TEST(Directions, FollowTheirVerticesThroughTheSort) {
  const Soup s = shuffled(joined(torus(30, 20), grid(12, 12, false, false), Vec3d(6, 0, 0)), 5);
  for (const std::uint64_t memory : {std::uint64_t{1} << 24, std::uint64_t{1} << 10}) {
    for (const bool wide : {false, true}) {
      IngestOptions options;
      options.tile_size = 50;
      options.memory_bytes = memory;
      options.spool_block_bytes = 1000;
      options.wide_ids = wide;
      EXPECT_EQ(count_directed(s, options), s.positions.size());
    }
  }
}

TEST(Directions, FollowThroughMergingAndSplitting) {
  // A soup: three vertices a triangle.
  const Soup whole = torus(20, 12);
  Soup soup;
  for (const Corner3& t : whole.triangles) {
    std::array<std::uint64_t, 3> corner{};
    for (int k = 0; k < 3; ++k) {
      const Vec3d p = whole.positions[t[k]];
      corner[k] = soup.add(p[0], p[1], p[2]);
    }
    soup.triangles.push_back(corner);
  }
  IngestOptions options;
  options.tile_size = 40;
  EXPECT_EQ(count_directed(soup, options), whole.positions.size());
  // Two sheets through one vertex: it is split, and both copies have its direction.
  Soup sheets = grid(4, 4, false, false);
  const std::uint64_t a = sheets.add(1, 1, 5), b = sheets.add(2, 1, 5);
  sheets.triangles.push_back({6, a, b});
  sheets.positions[0] += Vec3d(0.25, 0, 0);  // no direction is zero
  EXPECT_EQ(count_directed(sheets, options), sheets.positions.size() + 1);
}

TEST(Directions, VerticesOfFilledHolesHaveNone) {
  Soup s = grid(12, 12, true, false);  // a tube
  for (Vec3d& p : s.positions) {
    p += Vec3d(0, 0, 0.5);
  }
  IngestOptions options;
  options.tile_size = 40;
  options.fill_holes = 100;
  options.drop_components = 1;
  EXPECT_EQ(count_directed(s, options), s.positions.size());
}

}  // namespace
}  // namespace rattan
