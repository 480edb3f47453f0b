// SPDX-License-Identifier: MIT
// The comparison that decides whether a written file is kept.

#include "io/remesh/mesh_identity.h"

#include <algorithm>
#include <numeric>
#include <random>

#include <gtest/gtest.h>

#include "io/remesh/polygon_triangles.h"
#include "tests/io/test_meshes.h"

namespace rattan {
namespace {

/// Vertices and faces renumbered, faces started elsewhere.
PolygonMesh shuffled(const PolygonMesh& mesh, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::uint32_t> vertex(mesh.vertex_count());
  std::iota(vertex.begin(), vertex.end(), 0U);
  std::shuffle(vertex.begin(), vertex.end(), random);
  std::vector<std::size_t> order(mesh.face_count());
  std::iota(order.begin(), order.end(), 0U);
  std::shuffle(order.begin(), order.end(), random);
  PolygonMesh out;
  out.positions.resize(mesh.vertex_count());
  for (std::size_t v = 0; v < vertex.size(); ++v) {
    out.positions[vertex[v]] = mesh.positions[v];
  }
  for (const std::size_t f : order) {
    std::vector<std::uint32_t> face;
    for (const std::uint32_t v : mesh.face(f)) {
      face.push_back(vertex[v]);
    }
    std::rotate(face.begin(), face.begin() + static_cast<std::ptrdiff_t>(random() % face.size()),
                face.end());
    out.add_face(face);
  }
  return out;
}

/// Every vertex at the same place: only connectivity is left to compare.
PolygonMesh collapsed(PolygonMesh mesh) {
  for (Vec3d& p : mesh.positions) {
    p = Vec3d::Zero();
  }
  return mesh;
}

TEST(MeshIdentity, AcceptsAnyNumbering) {
  for (const auto& [name, mesh] : testing::all_meshes()) {
    SCOPED_TRACE(name);
    for (unsigned seed = 1; seed < 5; ++seed) {
      EXPECT_EQ(difference_as_meshes(mesh, shuffled(mesh, seed)), "");
      EXPECT_EQ(difference_as_meshes(collapsed(mesh), collapsed(shuffled(mesh, seed))), "");
    }
  }
}

TEST(MeshIdentity, SeesAMovedVertex) {
  for (const auto& [name, mesh] : testing::all_meshes()) {
    PolygonMesh other = shuffled(mesh, 3);
    other.positions[0][2] += 1e-9;
    EXPECT_NE(difference_as_meshes(mesh, other), "") << name;
    EXPECT_NE(difference_in_order(mesh, other), "") << name;
  }
}

TEST(MeshIdentity, SeesAFlippedFace) {
  for (const auto& [name, mesh] : testing::all_meshes()) {
    if (std::string(name) == "pillow") {
      continue;  // flipping one face of two equal ones
    }
    PolygonMesh other = shuffled(mesh, 4);
    const auto face = other.face(0);
    std::reverse(face.begin(), face.end());
    EXPECT_NE(difference_as_meshes(mesh, other), "") << name;
    EXPECT_NE(difference_as_meshes(collapsed(mesh), collapsed(other)) +
                  (mesh.face_count() == 1 ? "x" : ""),
              "")
        << name;
  }
}

TEST(MeshIdentity, SeesAWeldAndATear) {
  // The same positions and faces; only which of two coincident vertices a face uses differs.
  const PolygonMesh slit = testing::slit_ring(8);
  PolygonMesh welded = slit;
  for (std::uint32_t& v : welded.corners) {
    v = v >= 16 ? v - 16 : v;
  }
  EXPECT_NE(difference_as_meshes(slit, welded), "");  // two vertices are without faces then
  PolygonMesh crossed = slit;
  for (std::uint32_t& v : crossed.corners) {
    v = v == 0 ? 16 : v == 16 ? 0 : v;
  }
  EXPECT_EQ(difference_as_meshes(slit, crossed), "");  // a renumbering
  PolygonMesh torn = slit;
  torn.corners[0] = 16;  // face 0's own end moves to the other's vertex: joined in one corner
  EXPECT_NE(difference_as_meshes(slit, torn), "");
}

TEST(MeshIdentity, SeesComponentsJoinedCrosswise) {
  // Two coincident grids; then the same faces with a row of quads hung to the other sheet.
  const PolygonMesh one = testing::wavy_grid(4, 2);
  const PolygonMesh two = testing::join(one, one);
  PolygonMesh crossed = two;
  const auto n = static_cast<std::uint32_t>(one.vertex_count());
  const auto swap_sheet = [&](std::uint32_t& v) { v = v < n ? v + n : v - n; };
  // Upper row of both sheets: its lower side stays, its upper side belongs to the vertex above.
  for (std::size_t f = 0; f < crossed.face_count(); ++f) {
    if (f % one.face_count() == 0) {
      for (std::uint32_t& v : crossed.face(f)) {
        if (v % n == 6) {
          swap_sheet(v);
        }
      }
    }
  }
  EXPECT_NE(difference_as_meshes(two, crossed), "");
}

TEST(MeshIdentity, SeesAnotherDiagonal) {
  PolygonMesh a = testing::wavy_grid(1, 1);
  PolygonMesh b;
  PolygonMesh c;
  b.positions = c.positions = a.positions;
  testing::add(b, {0, 1, 3});
  testing::add(b, {0, 3, 2});
  testing::add(c, {0, 1, 2});
  testing::add(c, {1, 3, 2});
  EXPECT_NE(difference_as_meshes(b, c), "");
  EXPECT_NE(difference_as_meshes(a, b), "");
}

/// Whether the fans make a triangle mesh in which every edge has one triangle a side.
void expect_single_edges(const PolygonMesh& mesh) {
  const std::vector<std::uint32_t> apex = choose_fan_apexes(mesh);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> directed;
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const auto face = mesh.face(f);
    for (std::size_t t = 0; t + 2 < face.size(); ++t) {
      const std::uint32_t c[] = {face[apex[f]], face[(apex[f] + t + 1) % face.size()],
                                 face[(apex[f] + t + 2) % face.size()]};
      for (int i = 0; i < 3; ++i) {
        directed.emplace_back(c[i], c[(i + 1) % 3]);
      }
    }
  }
  std::sort(directed.begin(), directed.end());
  EXPECT_EQ(std::adjacent_find(directed.begin(), directed.end()), directed.end());
}

TEST(FanApexes, NeverDoubleAnEdge) {
  for (const auto& [name, mesh] : testing::all_meshes()) {
    SCOPED_TRACE(name);
    expect_single_edges(mesh);
  }
}

TEST(FanApexes, NeverDoubleAnEdgeOfRandomPolygons) {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(seed);
    // A torus of few vertices, so that diagonals meet edges and each other often.
    expect_single_edges(testing::merged(testing::torus(14, 9, 1), 0.72, 5 + seed % 5, seed));
  }
}

TEST(FanApexes, TakeTheDiagonalInsideAConcaveQuad) {
  PolygonMesh m;
  m.positions = {{0, 0, 0}, {4, 4, 0}, {0, 1, 0}, {-4, 4, 0}};  // corner 2 is reflex
  testing::add(m, {0, 1, 2, 3});
  EXPECT_EQ(choose_fan_apexes(m)[0] % 2, 0U);
  m.positions = {{-4, 4, 0}, {0, 0, 0}, {4, 4, 0}, {0, 1, 0}};
  EXPECT_EQ(choose_fan_apexes(m)[0] % 2, 1U);
}

}  // namespace
}  // namespace rattan
