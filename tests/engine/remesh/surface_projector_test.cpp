// SPDX-License-Identifier: MIT
#include "engine/remesh/surface_projector.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/task_arena.h>

#include "engine/core/memory_store.h"
#include "tests/engine/remesh/scan_shapes.h"

namespace rattan {
namespace {

using test::Noise;
using test::Soup;

/// Bumpy sheet with needles and triangles without area.
Soup rough_scan(double offset) {
  auto noise = std::make_shared<Noise>(7);
  Soup s = test::grid_scan(23, 17, [noise, offset](double u, double v) {
    return Vec3d(u + offset, v + 0.02 * (*noise)(), 0.15 * (*noise)());
  });
  for (std::size_t i = 0; i + 1 < s.positions.size(); i += 13) {
    s.positions[i] = s.positions[i + 1];
  }
  return s;
}

std::vector<ProjectionQuery> queries_near(const Soup& s, std::size_t count) {
  Noise noise(3);
  std::vector<ProjectionQuery> q;
  for (std::size_t i = 0; i < count; ++i) {
    const auto& t = s.triangles[i * 7919 % s.triangles.size()];
    const Vec3d& a = s.positions[t[0]];
    const Vec3d& b = s.positions[t[1]];
    const Vec3d& c = s.positions[t[2]];
    ProjectionQuery query;
    switch (i % 5) {
      case 0:
        query.point = a;
        break;
      case 1:
        query.point = 0.5 * (a + b);
        break;
      case 2:
        query.point = (a + b + c) / 3.0;
        break;
      case 3:
        query.point = a + 0.1 * noise.vector();
        break;
      default:
        query.point = a + 3.0 * noise.vector();
    }
    if (i % 3 == 0) {
      query.hint = (i * 104729) % s.triangles.size();
    }
    q.push_back(query);
  }
  return q;
}

std::vector<SurfacePoint> project(const Soup& s, const std::vector<ProjectionQuery>& q,
                                  std::uint32_t tile_size, std::uint32_t alive, int threads) {
  MemoryStore store;
  const ScanMesh mesh = tile_indexed_mesh(store, s.positions, s.triangles, tile_size);
  std::vector<SurfacePoint> r(q.size());
  oneapi::tbb::task_arena arena(threads);
  arena.execute([&] {
    TaskGraph graph({threads, 0});
    SurfaceProjector projector(store, mesh, {alive}, graph);
    projector.project(q, r, graph);
    // Once more, over whatever stayed alive.
    std::vector<SurfacePoint> again(q.size());
    projector.project(q, again, graph);
    for (std::size_t i = 0; i < q.size(); ++i) {
      EXPECT_EQ(r[i].triangle, again[i].triangle);
      EXPECT_EQ(r[i].distance2, again[i].distance2);
    }
  });
  return r;
}

TEST(ClosestOnTriangle, SevenRegionsAndDegenerates) {
  const Vec3d a(0, 0, 0);
  const Vec3d b(4, 0, 0);
  const Vec3d c(0, 4, 0);
  EXPECT_EQ(closest_on_triangle({1, 1, 2}, a, b, c).point, Vec3d(1, 1, 0));
  EXPECT_EQ(closest_on_triangle({1, 1, 2}, a, b, c).distance2, 4.0);
  EXPECT_EQ(closest_on_triangle({-1, -1, 0}, a, b, c).point, a);
  EXPECT_EQ(closest_on_triangle({6, -1, 0}, a, b, c).point, b);
  EXPECT_EQ(closest_on_triangle({-1, 7, 0}, a, b, c).point, c);
  EXPECT_EQ(closest_on_triangle({1, -3, 0}, a, b, c).point, Vec3d(1, 0, 0));
  EXPECT_EQ(closest_on_triangle({-3, 1, 0}, a, b, c).point, Vec3d(0, 1, 0));
  EXPECT_EQ(closest_on_triangle({4, 4, 0}, a, b, c).point, Vec3d(2, 2, 0));
  // Segments and points, whichever corners coincide.
  for (const auto& [p, q, r] : std::vector<std::array<Vec3d, 3>>{
           {a, b, a}, {a, b, b}, {a, a, b}, {b, a, 0.5 * (a + b)}, {0.25 * b, a, b}}) {
    const ClosestOnTriangle on = closest_on_triangle({1, 2, 0}, p, q, r);
    EXPECT_EQ(on.point, Vec3d(1, 0, 0));
    EXPECT_EQ(on.distance2, 4.0);
    const Vec3d back = on.weights[0] * p + on.weights[1] * q + on.weights[2] * r;
    EXPECT_LT((back - on.point).norm(), 1e-15);
  }
  EXPECT_EQ(closest_on_triangle({1, 2, 0}, a, a, a).point, a);
}

TEST(SurfaceProjector, AgreesWithBruteForce) {
  for (const double offset : {0.0, 1000.0}) {
    const Soup s = rough_scan(offset);
    const auto q = queries_near(s, 2000);
    const auto r = project(s, q, 97, 100, 2);
    // Triangle ids follow the order of canonical corner triples.
    auto sorted = s.triangles;
    for (auto& t : sorted) {
      std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    }
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t i = 0; i < q.size(); ++i) {
      ClosestHit best;
      ClosestOnTriangle on{};
      for (std::size_t t = 0; t < sorted.size(); ++t) {
        const auto c =
            closest_on_triangle(q[i].point, s.positions[sorted[t][0]].cast<float>().cast<double>(),
                                s.positions[sorted[t][1]].cast<float>().cast<double>(),
                                s.positions[sorted[t][2]].cast<float>().cast<double>());
        if (best.better(c.distance2, t)) {
          best = {c.distance2, t};
          on = c;
        }
      }
      ASSERT_EQ(r[i].triangle, best.triangle) << i;
      ASSERT_EQ(r[i].distance2, best.distance2) << i;
      ASSERT_EQ(r[i].point, on.point) << i;
      ASSERT_EQ(r[i].weights, on.weights) << i;
    }
  }
}

TEST(SurfaceProjector, TilesScenesAndThreadsChangeNothing) {
  const Soup s = rough_scan(0.0);
  const auto q = queries_near(s, 3000);
  const auto reference = project(s, q, 100000, 100, 1);
  for (const auto& [size, alive, threads] : std::vector<std::array<int, 3>>{
           {100000, 0, 2}, {64, 1000, 2}, {64, 3, 1}, {5, 0, 2}, {17, 10, 2}}) {
    const auto r =
        project(s, q, static_cast<std::uint32_t>(size), static_cast<std::uint32_t>(alive), threads);
    for (std::size_t i = 0; i < q.size(); ++i) {
      ASSERT_EQ(r[i].triangle, reference[i].triangle) << size << " " << i;
      ASSERT_EQ(r[i].point, reference[i].point) << size << " " << i;
      ASSERT_EQ(r[i].normal, reference[i].normal) << size << " " << i;
    }
  }
}

TEST(SurfaceProjector, TiesGoToTheLowestTriangle) {
  const Soup s = test::grid_scan(8, 8, [](double u, double v) { return Vec3d(u, v, 0.0); });
  std::vector<ProjectionQuery> q(1);
  q[0].point = Vec3d(0.5, 0.5, 0.25);  // above a vertex shared by six triangles
  const auto r = project(s, q, 9, 100, 2);
  auto sorted = s.triangles;
  for (auto& t : sorted) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  }
  std::sort(sorted.begin(), sorted.end());
  const std::uint32_t centre = 4 * 9 + 4;
  const auto lowest = std::find_if(sorted.begin(), sorted.end(), [&](const auto& t) {
    return std::find(t.begin(), t.end(), centre) != t.end();
  });
  EXPECT_EQ(r[0].triangle, static_cast<std::uint64_t>(lowest - sorted.begin()));
  EXPECT_EQ(r[0].distance2, 0.0625);
  EXPECT_EQ(r[0].normal, Vec3d(0, 0, 1));
}

TEST(SurfaceProjector, RadiusIsInclusiveAndBounds) {
  const Soup s = test::grid_scan(8, 8, [](double u, double v) { return Vec3d(u, v, 0.0); });
  std::vector<ProjectionQuery> q(3);
  q[0] = {Vec3d(0.3, 0.3, 0.25), 0.25, kNoTriangle};
  q[1] = {Vec3d(0.3, 0.3, 0.25), 0.2499, 12};
  q[2] = {Vec3d(0.3, 0.3, 0.25), 1e30, kNoTriangle};
  const auto r = project(s, q, 9, 100, 2);
  EXPECT_TRUE(r[0].found());
  EXPECT_FALSE(r[1].found());
  EXPECT_TRUE(r[2].found());
}

}  // namespace
}  // namespace rattan
