// SPDX-License-Identifier: MIT
#include "engine/mesh/ingest.h"

#include "tests/engine/mesh/ingest_checks.h"

namespace rattan {
namespace {

using namespace testing;

TEST(Ingest, CountsOfKnownSurfaces) {
  const auto t = ingest_and_check(torus(24, 16), 50).mesh;
  EXPECT_EQ(t.topology.euler(), 0);
  EXPECT_EQ(t.topology.components, 1U);
  EXPECT_EQ(t.topology.boundary_loops, 0U);
  const auto tube = ingest_and_check(grid(24, 16, true, false), 50).mesh;
  EXPECT_EQ(tube.topology.euler(), 0);
  EXPECT_EQ(tube.topology.boundary_loops, 2U);
  const auto patch = ingest_and_check(grid(24, 16, false, false), 50).mesh;
  EXPECT_EQ(patch.topology.euler(), 1);
  EXPECT_EQ(patch.topology.boundary_loops, 1U);
  const auto both =
      ingest_and_check(joined(torus(12, 9), grid(5, 4, true, false), Vec3d(9, 0, 0)), 32).mesh;
  EXPECT_EQ(both.topology.components, 2U);
  EXPECT_EQ(both.topology.boundary_loops, 2U);
  EXPECT_EQ(both.repaired.split_vertices, 0U);
  EXPECT_EQ(both.repaired.non_manifold_edges, 0U);
  EXPECT_EQ(both.repaired.flipped_triangles, 0U);
}

TEST(Ingest, MeasuresOfAFlatSquare) {
  Soup s = grid(10, 20, false, false);
  for (Vec3d& p : s.positions) {
    p[2] = 0;
  }
  const auto m = ingest_and_check(s, 40).mesh;
  EXPECT_NEAR(m.area, 200.0, 1e-9);
  EXPECT_NEAR(m.mean_edge_length, (2 + std::sqrt(2.0)) / 3, 1e-9);
  EXPECT_EQ(m.box_min, Vec3d(0, 0, 0));
  EXPECT_EQ(m.box_max, Vec3d(10, 20, 0));
  EXPECT_EQ(m.origin, Vec3d(0, 0, 0));
}

TEST(Ingest, TileSizeDecidesOnlyTheCuts) {
  const Soup s = joined(torus(30, 20), grid(12, 12, false, false), Vec3d(6, 0, 0));
  const auto one = ingest_and_check(s, 1000000000);
  EXPECT_EQ(one.mesh.layout.tile_count(), 1U);
  for (const std::uint32_t size : {1U, 7U, 32U, 64U, 100U}) {
    const auto many = ingest_and_check(s, size);
    EXPECT_GT(many.mesh.layout.tile_count(), 5U);
    EXPECT_EQ(many.whole, one.whole) << size;
    EXPECT_NEAR(many.mesh.area, one.mesh.area, 1e-9 * one.mesh.area);
  }
}

TEST(Ingest, OrderOfTheInputDoesNotMatter) {
  const Soup s = joined(torus(30, 20), grid(12, 12, false, false), Vec3d(6, 0, 0));
  const auto first = ingest_and_check(s, 64);
  const auto second = ingest_and_check(shuffled(s, 1), 64);
  EXPECT_EQ(first.whole, second.whole);
  EXPECT_EQ(geometry(first.whole).size(), s.triangles.size());
}

TEST(Ingest, TrianglesSurviveUnchanged) {
  const Soup s = shuffled(torus(30, 20), 2);
  Whole direct;
  for (const Vec3d& p : s.positions) {
    direct.positions.push_back(p.cast<float>());
  }
  direct.triangles = s.triangles;
  EXPECT_EQ(geometry(ingest_and_check(s, 64).whole), geometry(direct));
}

TEST(Ingest, FarCoordinatesKeepTheirDetail) {
  Soup s = grid(20, 20, false, false);
  for (Vec3d& p : s.positions) {
    p = p * 0.01 + Vec3d(4.5e6, -3.25e5, 812.0);
  }
  const auto i = ingest_and_check(s, 50);
  std::vector<std::array<double, 3>> expected;
  std::vector<std::array<double, 3>> actual;
  for (const Vec3d& p : s.positions) {
    expected.push_back({p[0], p[1], p[2]});
  }
  for (const Vec3f& p : i.whole.positions) {
    const Vec3d q = p.cast<double>() + i.mesh.origin;
    actual.push_back({q[0], q[1], q[2]});
  }
  std::sort(expected.begin(), expected.end());
  std::sort(actual.begin(), actual.end());
  ASSERT_EQ(expected.size(), actual.size());
  for (const auto& e : expected) {
    double best = 1;
    for (const auto& a : actual) {
      best = std::min(
          best, std::max({std::abs(e[0] - a[0]), std::abs(e[1] - a[1]), std::abs(e[2] - a[2])}));
    }
    EXPECT_LT(best, 2e-8);
  }
}

TEST(Ingest, OriginIsExactFor32BitCoordinates) {
  EXPECT_EQ(choose_origin(Vec3d(-1, -1, 2), Vec3d(1, 1, 3)), Vec3d(0, 0, 0));
  const Vec3d low(4500000.25, 0.1, 1e10);
  const Vec3d high(4500000.75, 0.9, 1e10);
  const Vec3d o = choose_origin(low, high);
  for (const float x : {4500000.25F, 4500000.5F, 4500000.75F}) {
    const double d = static_cast<double>(x) - o[0];
    EXPECT_EQ(static_cast<double>(static_cast<float>(d)), d);
    EXPECT_LT(std::abs(d), 2.0);
  }
  EXPECT_EQ(o[1], 0.0);
}

TEST(Ingest, BadIndicesAndEmptyScansAreTheInputsFault) {
  MemoryStore store;
  TaskGraph graph;
  Soup s = grid(3, 3, false, false);
  s.triangles[7][1] = 16;
  IngestOptions options;
  options.input_name = "dog.ply";
  try {
    ingest(store, s, options);
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("dog.ply: triangle 7: refers to vertex 16"),
              std::string::npos);
  }
  s.triangles[7][1] = 1ULL << 40;
  EXPECT_THROW(ingest(store, s, options), InputError);
  EXPECT_THROW(ingest(store, Soup{}), InputError);
  Soup points;
  points.add(1, 2, 3);
  EXPECT_THROW(ingest(store, points), InputError);
}

TEST(Ingest, AgreesWithTheInMemoryTiler) {
  const auto i =
      ingest_and_check(joined(torus(20, 15), grid(5, 6, true, false), Vec3d(9, 0, 0)), 40);
  std::vector<Vec3d> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (const Vec3f& p : i.whole.positions) {
    positions.push_back(p.cast<double>());
  }
  for (const Corner3& t : i.whole.triangles) {
    triangles.push_back({static_cast<std::uint32_t>(t[0]), static_cast<std::uint32_t>(t[1]),
                         static_cast<std::uint32_t>(t[2])});
  }
  MemoryStore store;
  const ScanMesh direct = tile_indexed_mesh(store, positions, triangles, 40);
  EXPECT_EQ(read_back(store, direct), i.whole);
  check_topology(direct, i.whole);
  EXPECT_EQ(direct.topology.edges, i.mesh.topology.edges);
  EXPECT_NEAR(direct.area, i.mesh.area, 1e-9 * direct.area);
  EXPECT_NEAR(direct.mean_edge_length, i.mesh.mean_edge_length, 1e-9 * direct.mean_edge_length);
}

// From one ingest to the next after every part, as a job does that is killed and resumed.
TEST(Ingest, EndsTheSameInParts) {
  const Soup s = shuffled(joined(torus(30, 20), grid(12, 12, false, false), Vec3d(6, 0, 0)), 3);
  const auto add = [&](Ingest& in) {
    in.add_vertices(s.positions);
    std::vector<Rgba> colours(s.positions.size() / 2);
    std::vector<VertexDirection> directions(s.positions.size());
    for (std::size_t v = 0; v < directions.size(); ++v) {
      directions[v].direction = s.positions[v].cast<float>();
      colours[v % colours.size()] = {static_cast<std::uint8_t>(v), 1, 2, 3};
    }
    in.add_colours(colours);
    in.add_directions(directions);
    // The first ones as polygons of three corners.
    const std::size_t polygons = s.triangles.size() / 4;
    std::vector<std::uint32_t> sizes(polygons, 3);
    std::vector<std::uint64_t> corners;
    for (std::size_t t = 0; t < polygons; ++t) {
      corners.insert(corners.end(), s.triangles[t].begin(), s.triangles[t].end());
    }
    in.add_polygons(sizes, corners);
    in.add_triangles(std::span(s.triangles).subspan(polygons));
  };
  TaskGraph graph;
  for (const bool wide : {false, true}) {
    for (const Merge merge : {Merge::kNever, Merge::kAlways}) {
      const IngestOptions options{.tile_size = 64,
                                  .merge = merge,
                                  .memory_bytes = 1 << 12,
                                  .spool_block_bytes = 500,
                                  .wide_ids = wide};
      MemoryStore one;
      Ingest in(one, options);
      add(in);
      const ScanMesh expected = in.finish(graph);
      MemoryStore store;
      IngestRecord left;
      {
        Ingest first(store, options);
        add(first);
        left = first.hand_over();
      }
      EXPECT_EQ(left.triangles, s.triangles.size());
      {
        Ingest second(store, options, left);
        second.order();
        left = second.hand_over();
      }
      ScanMesh mesh;
      {
        Ingest third(store, options, left);
        mesh = third.finish(graph);
      }
      EXPECT_EQ(read_back(store, mesh), read_back(one, expected));
      EXPECT_EQ(mesh.has_colours, expected.has_colours);
      EXPECT_EQ(mesh.topology.boundary_loops, expected.topology.boundary_loops);
      for (std::uint32_t t = 0; t < mesh.layout.tile_count(); ++t) {
        for (const std::string_view field :
             {std::string_view(fields::kColour.name), fields::kWantedDirection.name}) {
          EXPECT_EQ(*store.read_chunk(field, TileId(t)), *one.read_chunk(field, TileId(t)));
        }
      }
      for (const char* scratch :
           {"ingest/order", "ingest/raw_position", "ingest/raw_triangle", "ingest/raw_colour",
            "ingest/raw_direction", "ingest/position", "ingest/raw_wide_triangle"}) {
        EXPECT_FALSE(store.has_chunk(scratch, TileId(0))) << scratch;
      }
    }
  }
}

TEST(Ingest, LeavesNoScratchBehind) {
  class CountingStore final : public Store {
   public:
    void write_chunk(std::string_view field, TileId tile, ChunkBytes bytes) override {
      names.insert(std::string(field));
      store.write_chunk(field, tile, std::move(bytes));
    }
    ChunkBytes read_chunk(std::string_view field, TileId tile) override {
      return store.read_chunk(field, tile);
    }
    bool has_chunk(std::string_view field, TileId tile) const override {
      return store.has_chunk(field, tile);
    }
    void erase(std::string_view field) override {
      names.erase(std::string(field));
      store.erase(field);
    }
    MemoryStore store;
    std::set<std::string> names;
  };
  CountingStore store;
  IngestOptions options;
  options.memory_bytes = 2000;
  ingest(store, broken(), options);
  for (const std::string& name : store.names) {
    EXPECT_TRUE(name.starts_with("mesh/")) << name;
  }
}

}  // namespace
}  // namespace rattan
