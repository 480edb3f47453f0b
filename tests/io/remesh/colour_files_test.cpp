// SPDX-License-Identifier: MIT
// Colours of vertices through every format and back.

#include <cstdlib>
#include <fstream>

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "io/file/atomic_file.h"
#include "io/remesh/mesh_identity.h"
#include "io/remesh/remesh_reader.h"
#include "io/remesh/remesh_writer.h"
#include "tests/io/test_meshes.h"

namespace rattan {
namespace {

using testing::all_meshes;
using testing::NamedMesh;
using testing::ScratchDirectory;

PolygonMesh coloured(PolygonMesh mesh, bool alpha) {
  mesh.colours.clear();
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    mesh.colours.push_back({static_cast<std::uint8_t>(v), static_cast<std::uint8_t>(7 * v + 1),
                            static_cast<std::uint8_t>(v / 3),
                            static_cast<std::uint8_t>(alpha ? 251 * v : 255)});
  }
  return mesh;
}

/// The colour at each position, to compare where vertices come in another order.
std::vector<std::pair<std::array<float, 3>, Rgba>> by_position(const PolygonMesh& mesh) {
  std::vector<std::pair<std::array<float, 3>, Rgba>> list;
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    const Vec3f p = mesh.positions[v].cast<float>();
    list.push_back({{p[0], p[1], p[2]}, mesh.colours[v]});
  }
  std::sort(list.begin(), list.end());
  return list;
}

class EveryColouredFormat : public ::testing::TestWithParam<const char*> {};

TEST_P(EveryColouredFormat, BringsColoursBack) {
  const ScratchDirectory scratch;
  const std::string extension = GetParam();
  for (const NamedMesh& named : all_meshes()) {
    for (const bool alpha : {false, true}) {
      SCOPED_TRACE(named.name);
      const PolygonMesh mesh = coloured(named.mesh, alpha);
      const std::string path = scratch.file(named.name + extension);
      ASSERT_NO_THROW(write_remesh(mesh, {}, path));
      const PolygonMesh read = read_polygons(path);
      ASSERT_EQ(read.colours.size(), mesh.vertex_count());
      EXPECT_EQ(read.has_alpha(), alpha && extension != ".obj");
      if (extension == ".ply" || extension == ".off" || !alpha) {
        std::vector<Rgba> sorted = read.colours;
        std::vector<Rgba> meant = mesh.colours;
        std::sort(sorted.begin(), sorted.end());
        std::sort(meant.begin(), meant.end());
        EXPECT_EQ(sorted, meant);
        if (extension != ".drc") {
          EXPECT_EQ(read.colours, mesh.colours);
        }
      }
    }
  }
}

TEST_P(EveryColouredFormat, AChangedColourIsSeen) {
  const ScratchDirectory scratch;
  const std::string path = scratch.file(std::string("mesh") + GetParam());
  const std::string other = scratch.file(std::string("other") + GetParam());
  const PolygonMesh mesh = coloured(testing::torus(12, 8), false);
  PolygonMesh changed = mesh;
  changed.colours[17][1] ^= 1;
  PolygonMesh bare = mesh;
  bare.colours.clear();
  for (const PolygonMesh& wrong : {changed, bare}) {
    write_remesh(wrong, {}, other);
    WriteOptions options;
    options.before_verify = [&](const std::string& temporary) {
      std::ofstream(temporary, std::ios::trunc | std::ios::binary) << read_file(other);
    };
    EXPECT_THROW(write_remesh(mesh, {}, path, options), InternalError);
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, EveryColouredFormat,
                         ::testing::Values(".drc", ".obj", ".ply", ".off"),
                         [](const auto& format) { return std::string(format.param).substr(1); });

TEST(Colours, StayAtTheirPlacesInDraco) {
  const ScratchDirectory scratch;
  const std::string path = scratch.file("mesh.drc");
  PolygonMesh mesh = testing::torus(20, 14);
  for (const Vec3d& p : mesh.positions) {
    mesh.colours.push_back({static_cast<std::uint8_t>(128 + 20 * p[0]),
                            static_cast<std::uint8_t>(128 + 20 * p[1]),
                            static_cast<std::uint8_t>(128 + 20 * p[2]), 255});
  }
  write_remesh(mesh, {}, path);
  const PolygonMesh read = read_polygons_full(path);
  for (const auto& [p, c] : by_position(read)) {
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_LE(std::abs(128 + 20 * static_cast<double>(p[k]) - c[k]), 1.01);
    }
  }
}

TEST(Colours, AreOfThePlaceNotOnlyOfTheVertexNumber) {
  // Two vertices that share a position change colours: isomorphic only if the map may swap them.
  PolygonMesh a = coloured(testing::torus(6, 5), false);
  PolygonMesh b = a;
  std::swap(b.colours[3], b.colours[4]);
  EXPECT_NE(difference_as_meshes(a, b), "");
  EXPECT_NE(difference_in_order(a, b), "");
  b = a;
  b.colours.clear();
  EXPECT_NE(difference_as_meshes(a, b), "");
}

TEST(Colours, OfForeignTextAreRead) {
  const ScratchDirectory scratch;
  const auto read = [&](const char* name, const char* text) {
    const std::string path = scratch.file(name);
    std::ofstream(path) << text;
    return read_polygons(path).colours;
  };
  const std::vector<Rgba> expected = {{255, 0, 128, 255}, {0, 255, 0, 255}, {255, 255, 255, 255}};
  EXPECT_EQ(read("a.obj", "v 0 0 0 1 0 0.5\nv 1 0 0 0 1 0 # green\nv 0 1 0\nf 1 2 3\n"), expected);
  EXPECT_EQ(read("b.obj", "v 0 0 0 255 0 128\nv 1 0 0 0 255 0\nv 0 1 0\nf 1 2 3\n"), expected);
  EXPECT_EQ(read("c.obj", "v 0 0 0 1\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), std::vector<Rgba>{});
  EXPECT_EQ(read("a.off", "COFF\n3 1 0\n0 0 0 255 0 128\n1 0 0 0 255 0 255\n0 1 0\n3 0 1 2\n"),
            expected);
  EXPECT_EQ(read("b.off",
                 "CNOFF\n3 1 0\n0 0 0 0 0 1 1.0 0.0 0.5\n1 0 0 0 0 1 0.0 1.0 0.0\n"
                 "0 1 0 0 0 1\n3 0 1 2\n"),
            expected);
}

}  // namespace
}  // namespace rattan
