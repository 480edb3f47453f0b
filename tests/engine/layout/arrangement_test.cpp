// SPDX-License-Identifier: MIT
#include "engine/layout/arrangement.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <map>
#include <string>

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "engine/core/exact_math.h"
#include "tests/engine/layout/sample_meshes.h"

namespace rattan {
namespace {

using testing::expect_decomposition;
using testing::expect_same;
using testing::extract;
using testing::Extracted;
using testing::Fields;
using testing::IndexedMesh;

constexpr std::uint32_t kOneTile = 1000000000;

TEST(Arrangement, KeepsTopologyForRandomFields) {
  for (const IndexedMesh& m : testing::all_meshes()) {
    for (const double omega : {0.7, 2.0, 6.0, 40.0}) {
      for (std::uint64_t seed = 0; seed < 4; ++seed) {
        SCOPED_TRACE(m.name + ", omega " + std::to_string(omega) + ", seed " +
                     std::to_string(seed));
        const Fields f = testing::random_fields(m, seed);
        const int density = 1 + static_cast<int>(seed);
        const Extracted one = extract(m, f, omega, density, kOneTile);
        expect_decomposition(m, one.cells);
        if (::testing::Test::HasFailure()) {
          return;
        }
      }
    }
  }
}

TEST(Arrangement, DoesNotDependOnTilesOrThreads) {
  for (const IndexedMesh& m : testing::all_meshes()) {
    for (const double omega : {2.0, 8.0, 1000.0}) {
      SCOPED_TRACE(m.name + ", omega " + std::to_string(omega));
      const Fields f = testing::random_fields(m, 11);
      const Extracted one = extract(m, f, omega, 2, kOneTile);
      expect_decomposition(m, one.cells);
      for (const std::uint32_t size : {3U, 17U, 64U, 256U}) {
        SCOPED_TRACE("tiles of " + std::to_string(size));
        for (const int threads : {1, 2}) {
          const Extracted tiled = extract(m, f, omega, 2, size, threads);
          expect_same(one.cells, tiled.cells);
          EXPECT_EQ(one.report.singularities, tiled.report.singularities);
          EXPECT_EQ(one.report.dangling_ends, tiled.report.dangling_ends);
          EXPECT_EQ(one.report.dropped_circles, tiled.report.dropped_circles);
          EXPECT_EQ(one.report.cut_faces, tiled.report.cut_faces);
          if (::testing::Test::HasFailure()) {
            return;
          }
        }
      }
    }
  }
}

TEST(Arrangement, KeepsTopologyForFieldsWithNoise) {
  // Long lines with a few singularities: large faces, rings, dropped circles, cuts across tiles.
  std::uint64_t cut = 0;
  std::uint64_t circles = 0;
  for (const IndexedMesh& m : testing::all_meshes()) {
    for (std::uint64_t seed = 0; seed < 6; ++seed) {
      SCOPED_TRACE(m.name + ", seed " + std::to_string(seed));
      testing::Random random(seed);
      const double omega = 3.0 + 5.0 * static_cast<double>(seed);
      Fields f = testing::linear_fields(m, Vec3d(0.7, 0.2, 0.5), omega);
      const Fields noise = testing::random_fields(m, seed);
      for (std::size_t v = 0; v < f.frames.size(); ++v) {
        if (random.next() < 0.1) {
          f.phases[v] = noise.phases[v];
        }
        if (random.next() < 0.05) {
          f.frames[v] = noise.frames[v];
        }
      }
      const int density = 1 + static_cast<int>(seed % 3);
      const double period = seed % 2 == 0 ? omega : 10 * omega;
      const Extracted one = extract(m, f, period, density, kOneTile);
      expect_decomposition(m, one.cells);
      const Extracted tiled = extract(m, f, period, density, 5 + static_cast<std::uint32_t>(seed));
      expect_same(one.cells, tiled.cells);
      if (::testing::Test::HasFailure()) {
        return;
      }
      cut += one.report.cut_faces;
      circles += one.report.dropped_circles;
    }
  }
  EXPECT_GT(cut, 10U);
  EXPECT_GT(circles, 10U);
}

std::map<std::size_t, std::size_t> degrees(const CellComplex& c) {
  std::map<std::size_t, std::size_t> count;
  for (std::size_t f = 0; f < c.mesh.face_count(); ++f) {
    ++count[c.mesh.degree(f)];
  }
  return count;
}

/// Any phases; the frames ask for hardly any change, so that steps below half a period count as
/// given.
Fields phases_only(const IndexedMesh& m, const Vec3d& direction,
                   const std::function<double(const Vec3d&)>& theta,
                   const std::function<double(const Vec3d&)>& phi) {
  Fields f = testing::linear_fields(m, direction, 1.0);
  for (std::size_t v = 0; v < m.positions.size(); ++v) {
    const auto a = exact::sincos(theta(m.positions[v]));
    const auto b = exact::sincos(phi(m.positions[v]));
    f.phases[v].u = {static_cast<float>(a.cos), static_cast<float>(a.sin)};
    f.phases[v].v = {static_cast<float>(b.cos), static_cast<float>(b.sin)};
  }
  return f;
}

TEST(Arrangement, FindsTheExactGridOnAPlane) {
  // Lines at even coordinates from 2 to 12 and from 2 to 10, all of them through vertices.
  IndexedMesh m = testing::grid(12, 10);
  for (Vec3d& p : m.positions) {
    p += Vec3d(1, 1, 0);
  }
  const Fields f = testing::linear_fields(m, Vec3d(1, 0, 0), 4.0);
  const Extracted e = extract(m, f, 4.0, 2, 40);
  expect_decomposition(m, e.cells);
  EXPECT_EQ(degrees(e.cells), (std::map<std::size_t, std::size_t>{{4, 42}}));
  EXPECT_EQ(e.cells.mesh.vertex_count(), 56U);
  EXPECT_EQ(e.report.singularities, SingularityCounts{});
  EXPECT_EQ(e.report.dangling_ends, 0U);
  EXPECT_EQ(e.report.cut_faces, 0U);
  std::vector<std::pair<long, long>> got;
  std::size_t corners = 0;
  for (std::size_t v = 0; v < e.cells.mesh.vertex_count(); ++v) {
    const Vec3d& p = e.cells.mesh.positions[v];
    EXPECT_NEAR(p.x(), std::round(p.x()), 1e-5);
    EXPECT_NEAR(p.y(), std::round(p.y()), 1e-5);
    got.emplace_back(std::lround(p.x()), std::lround(p.y()));
    corners += (e.cells.mesh.vertex_flags[v] & kCornerVertex) != 0 ? 1 : 0;
  }
  std::vector<std::pair<long, long>> wanted;
  for (const long x : {1, 2, 4, 6, 8, 10, 12, 13}) {
    for (const long y : {1, 2, 4, 6, 8, 10, 11}) {
      wanted.emplace_back(x, y);
    }
  }
  std::sort(got.begin(), got.end());
  std::sort(wanted.begin(), wanted.end());
  EXPECT_EQ(got, wanted);
  EXPECT_EQ(corners, 4U);
}

TEST(Arrangement, FindsAnObliqueGridOnAPlane) {
  const IndexedMesh m = testing::grid(60, 60);
  const double omega = 14.0;
  const Vec3d k = Vec3d(3, 1, 0).normalized();
  const Extracted e = extract(m, testing::linear_fields(m, k, omega), omega, 2, 300);
  expect_decomposition(m, e.cells);
  EXPECT_EQ(e.report.singularities, SingularityCounts{});
  std::size_t inside = 0;
  for (std::size_t v = 0; v < e.cells.mesh.vertex_count(); ++v) {
    if ((e.cells.mesh.vertex_flags[v] & kBoundaryVertex) == 0) {
      const Vec3d& p = e.cells.mesh.positions[v];
      const double x = k.dot(p) / 7.0;
      const double y = Vec3d(-k.y(), k.x(), 0).dot(p) / 7.0;
      EXPECT_NEAR(x, std::round(x), 1e-5);
      EXPECT_NEAR(y, std::round(y), 1e-5);
      ++inside;
    }
  }
  EXPECT_GT(inside, 50U);
}

TEST(Arrangement, MakesATorusAllQuad) {
  const std::uint32_t nu = 24;
  const std::uint32_t nv = 12;
  const IndexedMesh m = testing::torus(nu, nv);
  Fields f = testing::linear_fields(m, Vec3d(0, 0, 1), 1.0);
  for (std::uint32_t v = 0; v < nu * nv; ++v) {
    const std::uint32_t u = v / nv;
    VertexFrame& frame = f.frames[v];
    const auto [s, c] = exact::sincos(2 * exact::kPi * u / nu);
    frame.direction = Vec3f(static_cast<float>(-s), static_cast<float>(c), 0.0F);
    const Vec3d along_v = m.positions[u * nv + (v + 1) % nv] - m.positions[v];
    const Vec3f perp = frame.normal.cross(frame.direction);
    const double sign = along_v.dot(perp.cast<double>()) > 0 ? 1 : -1;
    // Periods of six edges: lines three edges apart, through vertices.
    const auto a = exact::sincos(2 * exact::kPi * u / 6);
    const auto b = exact::sincos(sign * 2 * exact::kPi * (v % nv) / 6);
    f.phases[v].u = {static_cast<float>(a.cos), static_cast<float>(a.sin)};
    f.phases[v].v = {static_cast<float>(b.cos), static_cast<float>(b.sin)};
  }
  const Extracted e = extract(m, f, 6.0 * nv / 6.0 * 3.0 * 2 * exact::kPi / nu, 2, 50);
  expect_decomposition(m, e.cells);
  EXPECT_EQ(e.report.singularities, SingularityCounts{});
  EXPECT_EQ(degrees(e.cells), (std::map<std::size_t, std::size_t>{{4, 8 * 4}}));
  EXPECT_EQ(e.cells.mesh.vertex_count(), 32U);
  std::vector<int> valence(32, 0);
  for (const std::uint32_t v : e.cells.mesh.corners) {
    ++valence[v];
  }
  EXPECT_EQ(std::count(valence.begin(), valence.end(), 4), 32);
}

TEST(Arrangement, EndsLinesAtAVortexAndAtAFieldSingularity) {
  const IndexedMesh m = testing::grid(20, 20);
  const auto angle = [](const Vec3d& p) { return exact::atan2(p.y() - 9.3, p.x() - 10.6); };
  const Fields vortex = phases_only(m, Vec3d(1, 0, 0), angle, [](const Vec3d&) { return 0.4; });
  for (int density = 1; density < 6; ++density) {
    const Extracted e = extract(m, vortex, 1e6, density, 64);
    expect_decomposition(m, e.cells);
    EXPECT_EQ(e.report.singularities.phase_triangles, 1U);
    EXPECT_EQ(e.report.singularities.field_triangles, 0U);
    EXPECT_EQ(e.report.singularities.vertices, 3U);
    EXPECT_EQ(e.report.singularities.edges, 1U);
    EXPECT_EQ(e.report.dangling_ends, static_cast<std::uint64_t>(density));
    const auto singular = std::count(e.cells.face_singular.begin(), e.cells.face_singular.end(), 1);
    EXPECT_EQ(singular, 1);
  }
  Fields quarter = testing::linear_fields(m, Vec3d(1, 0, 0), 1e6);
  for (std::size_t v = 0; v < m.positions.size(); ++v) {
    const auto [s, c] = exact::sincos(0.25 * angle(m.positions[v]));
    quarter.frames[v].direction = Vec3f(static_cast<float>(c), static_cast<float>(s), 0.0F);
  }
  const Extracted e = extract(m, quarter, 1e6, 2, 64);
  expect_decomposition(m, e.cells);
  EXPECT_EQ(e.report.singularities.field_triangles, 1U);
  EXPECT_EQ(e.report.singularities.vertices, 3U);
}

TEST(Arrangement, CutsRingsAndDropsContractibleCircles) {
  // Circles around a torus's hole only: rings between them.
  const IndexedMesh ring = testing::torus(24, 12);
  const Fields around = phases_only(
      ring, Vec3d(0, 0, 1),
      [](const Vec3d& p) { return 2 * exact::atan2(p.z(), std::hypot(p.x(), p.y()) - 6.0); },
      [](const Vec3d&) { return 0.4; });
  const Extracted rings = extract(ring, around, 1e6, 1, 40);
  expect_decomposition(ring, rings.cells);

  // Concentric circles in a square: all but none contractible.
  const IndexedMesh square = testing::grid(16, 16);
  const Fields target = phases_only(
      square, Vec3d(1, 0, 0),
      [](const Vec3d& p) { return 0.8 * (p - Vec3d(8, 8, 0)).norm() + 1.0; },
      [](const Vec3d&) { return 0.4; });
  const Extracted circles = extract(square, target, 1e6, 1, 40);
  expect_decomposition(square, circles.cells);
  EXPECT_GT(circles.report.dropped_circles, 0U);
}

TEST(Arrangement, DividesComponentsWithoutLines) {
  using namespace testing;
  const auto constant = [](const Vec3d&) { return 0.4; };
  for (const IndexedMesh& m :
       {sphere(3), torus(24, 12), plate({"#####", "#.#.#", "#####"}), tetrahedron(), pillow(),
        join({sphere(2), torus(9, 5), tetrahedron(), pillow()})}) {
    SCOPED_TRACE(m.name);
    const Fields f = phases_only(m, Vec3d(0.3, 0.5, 0.8), constant, constant);
    // A field with singularities may still leave lines: frames without turns.
    Fields flat = f;
    for (VertexFrame& frame : flat.frames) {
      frame.normal = Vec3f(0, 0, 1);
      frame.direction = Vec3f(1, 0, 0);
    }
    const Extracted one = extract(m, flat, 1e6, 2, kOneTile);
    expect_decomposition(m, one.cells);
    EXPECT_GE(one.report.bare_components, 1U);
    EXPECT_GE(one.cells.mesh.face_count(), 2U);
    const Extracted tiled = extract(m, flat, 1e6, 2, 20);
    expect_same(one.cells, tiled.cells);
  }
  // With a boundary, the component itself is the face.
  const IndexedMesh m = grid(10, 7);
  const Extracted e = extract(m, phases_only(m, Vec3d(1, 0, 0), constant, constant), 1e6, 2, 20);
  expect_decomposition(m, e.cells);
  EXPECT_EQ(e.cells.mesh.face_count(), 1U);
  EXPECT_EQ(e.cells.mesh.vertex_count(), 4U);
}

TEST(Arrangement, SpacesVerticesAlongLongEdges) {
  // One line across a strip of 40 by 4 whose sides are 1: long edges on the boundary.
  const IndexedMesh m = testing::grid(40, 4);
  const auto constant = [](const Vec3d&) { return 0.4; };
  const Fields f = phases_only(m, Vec3d(1, 0, 0), constant, constant);
  const Extracted e = extract(m, f, 8.0, 2, 30);
  expect_decomposition(m, e.cells);
  // Sides of 40 in ten parts, sides of 4 in one.
  EXPECT_EQ(e.cells.mesh.vertex_count(), 22U);
  EXPECT_EQ(e.report.spaced_vertices, 18U);
  for (const Vec3d& p : e.cells.mesh.positions) {
    EXPECT_NEAR(p.x(), 4 * std::round(p.x() / 4), 1e-9);
  }
}

TEST(Arrangement, FindsCornersAtTheScaleOfTheCells) {
  // A square whose lower boundary zigzags by one edge, which turns by 45 degrees or more
  // everywhere.
  IndexedMesh m = testing::grid(24, 24);
  for (std::uint32_t x = 1; x < 24; x += 2) {
    m.positions[x].y() = -1.2;
  }
  const auto constant = [](const Vec3d&) { return 0.4; };
  const Fields f = phases_only(m, Vec3d(1, 0, 0), constant, constant);
  for (const std::uint32_t tile : {kOneTile, 30U}) {
    const Extracted e = extract(m, f, 24.0, 2, tile);
    expect_decomposition(m, e.cells);
    std::vector<Vec3d> corners;
    for (std::size_t v = 0; v < e.cells.mesh.vertex_count(); ++v) {
      if ((e.cells.mesh.vertex_flags[v] & kCornerVertex) != 0) {
        corners.push_back(e.cells.mesh.positions[v]);
      }
    }
    ASSERT_EQ(corners.size(), 4U);
    for (const Vec3d& c : corners) {
      EXPECT_TRUE(c.x() <= 1 || c.x() >= 23) << c.transpose();
    }
  }
}

TEST(Arrangement, SurvivesTrianglesWithoutArea) {
  IndexedMesh m = testing::plate({"####", "#..#", "####"});
  for (Vec3d& p : m.positions) {
    p = Vec3d(std::floor(p.x()), std::floor(p.y()), 0.0);
  }
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const Fields f = testing::random_fields(m, seed);
    const Extracted one = extract(m, f, 1.5, 2, kOneTile);
    expect_decomposition(m, one.cells);
    expect_same(one.cells, extract(m, f, 1.5, 2, 10).cells);
  }
  for (Vec3d& p : m.positions) {
    p = Vec3d(1, 2, 3);
  }
  expect_decomposition(m, extract(m, testing::random_fields(m, 9), 1.5, 2, 10).cells);
}

TEST(Arrangement, GivesUpWhereLinesCrossTooOften) {
  // Six lines cross five, in triangles with few and with many crossings.
  IndexedMesh m = testing::grid(12, 10);
  for (Vec3d& p : m.positions) {
    p += Vec3d(1, 1, 0);
  }
  const Fields fine = testing::linear_fields(m, Vec3d(1, 0, 0), 4.0);
  EXPECT_EQ(extract(m, fine, 4.0, 2, 1000, 1, 30).cells.mesh.face_count(), 42U);
  EXPECT_THROW(extract(m, fine, 4.0, 2, 1000, 1, 29), TooManyCrossings);
  IndexedMesh large = testing::grid(1, 1, 200.0);
  for (Vec3d& p : large.positions) {
    p += Vec3d(1, 1, 0);
  }
  const Fields wide = testing::linear_fields(large, Vec3d(1, 0, 0), 1000.0);
  EXPECT_EQ(extract(large, wide, 1000.0, 500, 1000, 1, 10000).report.singularities,
            SingularityCounts{});
  EXPECT_THROW(extract(large, wide, 1000.0, 500, 1000, 1, 9999), TooManyCrossings);
}

TEST(Arrangement, RejectsOptionsOutOfRange) {
  const IndexedMesh m = testing::tetrahedron();
  const Fields f = testing::random_fields(m, 1);
  EXPECT_THROW(extract(m, f, 0.0, 2, 10), UsageError);
  EXPECT_THROW(extract(m, f, 1.0, 0, 10), UsageError);
}

TEST(Arrangement, KeepsTheTopologyOfSampleScans) {
  const char* data = std::getenv("RATTAN_DATA");
  if (data == nullptr) {
    GTEST_SKIP() << "RATTAN_DATA is not set";
  }
  for (const std::string name : {"3holes.off", "fertility.off", "spot.obj", "plane_holes.obj",
                                 "rocker-arm.obj", "demosthenes-low-res.obj"}) {
    const IndexedMesh m = testing::read_sample(std::string(data) + "/" + name);
    if (m.triangles.empty()) {
      continue;  // needs repair
    }
    SCOPED_TRACE(name);
    double edge = 0.0;
    for (const auto& t : m.triangles) {
      edge += (m.positions[t[0]] - m.positions[t[1]]).norm();
    }
    edge /= static_cast<double>(m.triangles.size());
    for (const double periods : {4.0, 16.0}) {
      for (const bool random : {false, true}) {
        const double omega = periods * edge;
        const Fields f = random ? testing::random_fields(m, 3)
                                : testing::linear_fields(m, Vec3d(0.2, 1.0, 0.4), omega);
        const Extracted one = extract(m, f, omega, 2, kOneTile);
        expect_decomposition(m, one.cells);
        expect_same(one.cells, extract(m, f, omega, 2, 700, 2).cells);
      }
    }
  }
}

}  // namespace
}  // namespace rattan
