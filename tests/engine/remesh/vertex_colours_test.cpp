// SPDX-License-Identifier: MIT
#include "engine/remesh/vertex_colours.h"

#include <gtest/gtest.h>

#include "engine/core/memory_store.h"
#include "tests/engine/remesh/scan_shapes.h"

namespace rattan {
namespace {

using test::Soup;

Rgba linear(const Vec3d& p) {
  Rgba c{0, 0, 0, 0};
  for (int k = 0; k < 3; ++k) {
    c[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(std::floor(100.5 + 60.0 * p[k]));
  }
  c[3] = static_cast<std::uint8_t>(std::floor(200.5 + 20.0 * p[0] - 30.0 * p[1]));
  return c;
}

/// Colours of a scan tiled by tile_indexed_mesh.
void colour_tiles(Store& store, ScanMesh& mesh) {
  mesh.has_colours = true;
  for (std::uint32_t t = 0; t < mesh.layout.tile_count(); ++t) {
    const TileMesh tile = load_tile(store, mesh, TileId(t));
    std::vector<Rgba> colours;
    for (const Vec3f& p : tile.positions) {
      colours.push_back(linear(p.cast<double>()));
    }
    write(store, fields::kColour, TileId(t), colours);
  }
}

TEST(VertexColours, ALinearFunctionIsReproduced) {
  const auto identity = [](const Vec3d& p) { return p; };
  const Soup scan = test::cube_scan(9, identity);
  std::vector<Rgba> first;
  for (const std::uint32_t tile_size : {20U, 100000U}) {
    MemoryStore store;
    ScanMesh mesh = tile_indexed_mesh(store, scan.positions, scan.triangles, tile_size);
    colour_tiles(store, mesh);
    TaskGraph graph;
    SurfaceProjector projector(store, mesh, {}, graph);
    PolygonMesh remesh = test::cube_remesh(7, identity);
    transfer_colours(remesh, store, mesh, projector, graph);
    ASSERT_EQ(remesh.colours.size(), remesh.vertex_count());
    for (std::size_t v = 0; v < remesh.vertex_count(); ++v) {
      const Rgba expected = linear(remesh.positions[v]);
      for (std::size_t c = 0; c < 4; ++c) {
        // Corners were rounded, and their mean is once more.
        EXPECT_LE(std::abs(int{remesh.colours[v][c]} - int{expected[c]}), 1);
      }
    }
    if (first.empty()) {
      first = remesh.colours;
    }
    EXPECT_EQ(remesh.colours, first);
    // Off the surface the closest point counts.
    const std::vector<Rgba> on = remesh.colours;
    for (Vec3d& p : remesh.positions) {
      p *= 1.0 + 1e-9;
    }
    transfer_colours(remesh, store, mesh, projector, graph);
    std::size_t same = 0;
    for (std::size_t v = 0; v < on.size(); ++v) {
      same += remesh.colours[v] == on[v] ? 1 : 0;
    }
    EXPECT_GT(same, on.size() * 9 / 10);
  }
}

}  // namespace
}  // namespace rattan
