// SPDX-License-Identifier: MIT
#include "engine/param/triangle_coordinates.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/exact_math.h"
#include "engine/core/memory_store.h"
#include "engine/core/tile_layout.h"

namespace rattan {
namespace {

constexpr double kTurn = 2 * exact::kPi;

double random_unit(std::uint64_t& state) {
  state = state * 6364136223846793005ULL + 1442695040888963407ULL;
  return static_cast<double>(state >> 11) * 0x1p-53;
}

EdgeTransport random_transport(std::uint64_t& state) {
  EdgeTransport t;
  t.r = static_cast<std::uint32_t>(4 * random_unit(state));
  t.s = static_cast<std::int32_t>(9 * random_unit(state)) - 4;
  t.t = static_cast<std::int32_t>(9 * random_unit(state)) - 4;
  return t;
}

void apply(const EdgeTransport& t, std::int64_t& a, std::int64_t& b) {
  quarter_turns(t.r, a, b);
  a += t.s;
  b += t.t;
}

TEST(EdgeTransport, IsAGroupThatActs) {
  std::uint64_t state = 5;
  for (int i = 0; i < 1000; ++i) {
    const EdgeTransport x = random_transport(state);
    const EdgeTransport y = random_transport(state);
    std::int64_t a = 3;
    std::int64_t b = -7;
    apply(y, a, b);
    apply(x, a, b);
    std::int64_t c = 3;
    std::int64_t d = -7;
    apply(compose(x, y), c, d);
    EXPECT_EQ(a, c);
    EXPECT_EQ(b, d);
    EXPECT_EQ(compose(x, inverse(x)), EdgeTransport{});
    EXPECT_EQ(compose(inverse(x), x), EdgeTransport{});
  }
}

TEST(EdgeTransport, BringsTheFarAnglesWithinHalfAPeriodOfTheGauge) {
  std::uint64_t state = 9;
  for (int i = 0; i < 1000; ++i) {
    const EdgeGauge g{static_cast<std::uint32_t>(4 * random_unit(state)),
                      40 * random_unit(state) - 20, 40 * random_unit(state) - 20};
    const PhaseAngles lo{kTurn * (random_unit(state) - 0.5), kTurn * (random_unit(state) - 0.5)};
    const PhaseAngles hi{kTurn * (random_unit(state) - 0.5), kTurn * (random_unit(state) - 0.5)};
    const EdgeTransport t = edge_transport(g, lo, hi);
    PhaseAngles far = hi;
    quarter_turns(t.r, far.theta, far.phi);
    EXPECT_EQ(t.r, g.r);
    EXPECT_LE(std::abs(far.theta + kTurn * t.s - lo.theta - g.delta), exact::kPi + 1e-9);
    EXPECT_LE(std::abs(far.phi + kTurn * t.t - lo.phi - g.delta_perp), exact::kPi + 1e-9);
  }
}

TEST(PhaseAngles, TakeAnyNumber) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  PairValue x;
  x.u = {nan, 1.0F};
  x.v = {0.0F, -2.0F};
  const PhaseAngles a = phase_angles(x);
  EXPECT_EQ(a.theta, 0.0);
  EXPECT_NEAR(a.phi, -exact::kPi / 2, 1e-15);
}

/// A scan in tiles with given fields.
struct Scan {
  MemoryStore store;
  ScanMesh mesh;
  std::vector<VertexFrame> frames;
  std::vector<PairValue> phases;
};

/// n times n squares of side 1.
void make_grid(Scan& scan, std::uint32_t n, std::uint32_t tile_size) {
  std::vector<Vec3d> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (std::uint32_t i = 0; i < (n + 1) * (n + 1); ++i) {
    positions.emplace_back(i % (n + 1), i / (n + 1), 0.0);
  }
  for (std::uint32_t i = 0; i < n * n; ++i) {
    const std::uint32_t a = i / n * (n + 1) + i % n;
    triangles.push_back({a, a + 1, a + n + 2});
    triangles.push_back({a, a + n + 2, a + n + 1});
  }
  scan.mesh = tile_indexed_mesh(scan.store, positions, triangles, tile_size);
  scan.frames.resize(positions.size());
  scan.phases.resize(positions.size());
  for (std::size_t v = 0; v < positions.size(); ++v) {
    scan.frames[v].position = positions[v].cast<float>();
  }
}

void randomize(Scan& scan, std::uint64_t seed) {
  for (std::size_t v = 0; v < scan.frames.size(); ++v) {
    const auto k = exact::sincos(kTurn * random_unit(seed));
    const auto a = exact::sincos(kTurn * random_unit(seed));
    const auto b = exact::sincos(kTurn * random_unit(seed));
    scan.frames[v].direction = Vec3f(static_cast<float>(k.cos), static_cast<float>(k.sin), 0.0F);
    scan.phases[v].u = {static_cast<float>(a.cos), static_cast<float>(a.sin)};
    scan.phases[v].v = {static_cast<float>(b.cos), static_cast<float>(b.sin)};
  }
}

TileCoordinates coordinates(Scan& scan, const TileMesh& tile, double omega) {
  std::vector<VertexFrame> frames;
  std::vector<PairValue> phases;
  for (std::uint32_t v = 0; v < tile.local_vertices(); ++v) {
    frames.push_back(scan.frames[tile.global_id(v)]);
    phases.push_back(scan.phases[tile.global_id(v)]);
  }
  return tile_coordinates(tile, frames, phases, omega);
}

SingularityCounts count(Scan& scan, double omega) {
  SingularityCounts sum;
  for (std::uint32_t t = 0; t < scan.mesh.layout.tile_count(); ++t) {
    const TileMesh tile = load_tile(scan.store, scan.mesh, TileId(t));
    sum += count_singularities(tile, coordinates(scan, tile, omega));
  }
  return sum;
}

TEST(TriangleCoordinates, ListsEveryEdgeWithItsSides) {
  Scan scan;
  make_grid(scan, 9, 13);
  randomize(scan, 3);
  for (std::uint32_t t = 0; t < scan.mesh.layout.tile_count(); ++t) {
    const TileMesh tile = load_tile(scan.store, scan.mesh, TileId(t));
    const TileCoordinates c = coordinates(scan, tile, 3.0);
    std::size_t sides = 0;
    for (std::uint32_t e = 0; e < c.edges.size(); ++e) {
      const TileEdge& edge = c.edges[e];
      EXPECT_LT(c.ids[edge.lo], c.ids[edge.hi]);
      EXPECT_EQ(c.find_edge(edge.lo, edge.hi), e);
      EXPECT_EQ(c.find_edge(edge.hi, edge.lo), e);
      for (const std::uint32_t side : {edge.left, edge.right}) {
        if (side == kNoSide) {
          continue;
        }
        ++sides;
        const LocalTriangle& tri = tile.triangles[side / 3];
        const std::uint32_t from = tri[side % 3];
        const std::uint32_t to = tri[(side + 1) % 3];
        EXPECT_EQ(from, side == edge.left ? edge.lo : edge.hi);
        EXPECT_EQ(to, side == edge.left ? edge.hi : edge.lo);
        EXPECT_EQ(c.side_edge[side], e);
      }
    }
    EXPECT_EQ(sides, 3 * tile.triangles.size());
  }
}

TEST(Singularities, DoNotDependOnTiles) {
  for (const double omega : {1.5, 6.0}) {
    SingularityCounts first;
    for (const std::uint32_t size : {1000U, 40U, 7U, 1U}) {
      Scan scan;
      make_grid(scan, 14, size);
      randomize(scan, 21);
      const SingularityCounts c = count(scan, omega);
      if (size == 1000U) {
        first = c;
        EXPECT_GT(c.field_triangles, 10U);
        EXPECT_GT(c.phase_triangles, 10U);
        EXPECT_GT(c.negative_triangles, 0U);
        EXPECT_GT(c.edges, 10U);
      }
      EXPECT_EQ(c, first);
    }
  }
}

/// Vertices by their definition: the transports around the one-ring, for all interior vertices.
TEST(Singularities, AreWhereTheyAreCountedInAllTiles) {
  std::vector<std::uint8_t> first;
  for (const std::uint32_t size : {1000U, 40U, 1U}) {
    Scan scan;
    make_grid(scan, 14, size);
    randomize(scan, 21);
    SingularityCounts sum;
    std::array<std::uint64_t, 4> kinds{};
    std::vector<std::uint8_t> triangles;
    std::vector<std::uint8_t> vertices;
    std::uint64_t singular = 0;
    std::uint64_t edge_ends = 0;
    for (std::uint32_t t = 0; t < scan.mesh.layout.tile_count(); ++t) {
      const TileMesh tile = load_tile(scan.store, scan.mesh, TileId(t));
      const TileCoordinates c = coordinates(scan, tile, 6.0);
      TileSingularities where;
      const SingularityCounts counts = count_singularities(tile, c, &where);
      EXPECT_EQ(counts, count_singularities(tile, c));
      sum += counts;
      ASSERT_EQ(where.triangles.size(), tile.counts.owned);
      ASSERT_EQ(where.vertices.size(), tile.extent.owned);
      for (const TriangleKind kind : where.triangles) {
        ++kinds[static_cast<std::size_t>(kind)];
        triangles.push_back(static_cast<std::uint8_t>(kind));
      }
      for (std::uint32_t v = 0; v < tile.extent.owned; ++v) {
        singular += where.vertices[v];
        edge_ends += where.edges_at_vertex[v];
        vertices.push_back(where.vertices[v]);
        vertices.push_back(where.edges_at_vertex[v]);
      }
    }
    EXPECT_EQ(kinds[1], sum.field_triangles);
    EXPECT_EQ(kinds[2], sum.phase_triangles);
    EXPECT_EQ(kinds[3], sum.negative_triangles);
    EXPECT_EQ(singular, sum.vertices);
    EXPECT_EQ(edge_ends, 2 * sum.edges);
    triangles.insert(triangles.end(), vertices.begin(), vertices.end());
    if (first.empty()) {
      first = triangles;
    }
    EXPECT_EQ(triangles, first) << size;
  }
}

TEST(Singularities, AgreeWithTheRingsOfAllVertices) {
  Scan scan;
  const std::uint32_t n = 14;
  make_grid(scan, n, 100000);
  randomize(scan, 4);
  const TileMesh tile = load_tile(scan.store, scan.mesh, TileId(0));
  const TileCoordinates c = coordinates(scan, tile, 5.0);
  const std::int32_t row = static_cast<std::int32_t>(n) + 1;
  std::uint64_t open = 0;
  for (std::int32_t y = 1; y < row - 1; ++y) {
    for (std::int32_t x = 1; x < row - 1; ++x) {
      const std::int32_t v = y * row + x;
      const std::vector<std::int32_t> ring{v + 1, v + row + 1, v + row,
                                           v - 1, v - row - 1, v - row};
      EdgeTransport product;
      for (std::size_t i = 0; i < ring.size(); ++i) {
        const auto from = static_cast<std::uint32_t>(ring[i]);
        const auto to = static_cast<std::uint32_t>(ring[(i + 1) % ring.size()]);
        const TileEdge& e = c.edges[c.find_edge(from, to)];
        product = compose(product, e.lo == from ? e.transport : inverse(e.transport));
      }
      open += product == EdgeTransport{} ? 0 : 1;
    }
  }
  EXPECT_GT(open, 20U);
  EXPECT_EQ(count_singularities(tile, c).vertices, open);
}

TEST(Singularities, AreNoneForLinearPhases) {
  Scan scan;
  make_grid(scan, 14, 50);
  const double omega = 5.0;
  for (std::size_t v = 0; v < scan.frames.size(); ++v) {
    const Vec3d p = scan.frames[v].position.cast<double>();
    // Frames turned by quarter turns at random places: the same parameterization.
    const auto a = exact::sincos(kTurn * (0.6 * p.x() + 0.8 * p.y()) / omega);
    const auto b = exact::sincos(kTurn * (-0.8 * p.x() + 0.6 * p.y()) / omega);
    PairValue x;
    x.u = {static_cast<float>(a.cos), static_cast<float>(a.sin)};
    x.v = {static_cast<float>(b.cos), static_cast<float>(b.sin)};
    Vec3f k(0.6F, 0.8F, 0.0F);
    for (std::uint32_t r = 0; r < v * 7 % 4; ++r) {
      k = Vec3f(-k.y(), k.x(), 0.0F);
    }
    scan.frames[v].direction = k;
    scan.phases[v] = quarter_turn(x, static_cast<std::uint32_t>(v * 7 % 4));
  }
  EXPECT_EQ(count(scan, omega), SingularityCounts{});
  // A mirrored parameterization folds every triangle.
  for (std::size_t v = 0; v < scan.frames.size(); ++v) {
    scan.frames[v].direction = Vec3f(1, 0, 0);
    const auto a = exact::sincos(-0.2 * static_cast<double>(scan.frames[v].position.x()));
    const auto b = exact::sincos(0.2 * static_cast<double>(scan.frames[v].position.y()));
    scan.phases[v].u = {static_cast<float>(a.cos), static_cast<float>(a.sin)};
    scan.phases[v].v = {static_cast<float>(b.cos), static_cast<float>(b.sin)};
  }
  const SingularityCounts c = count(scan, 1e6);
  EXPECT_EQ(c.negative_triangles, 2U * 14 * 14);
  EXPECT_EQ(c.field_triangles + c.phase_triangles + c.vertices + c.edges, 0U);
}

}  // namespace
}  // namespace rattan
