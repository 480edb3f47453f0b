// SPDX-License-Identifier: MIT
#include "engine/remesh/vertex_colours.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/core/errors.h"

namespace rattan {

void transfer_colours(PolygonMesh& remesh, Store& store, const ScanMesh& scan,
                      SurfaceProjector& projector, TaskGraph& graph) {
  ensure(scan.has_colours, "a scan without colours has none to transfer");
  const std::size_t n = remesh.vertex_count();
  std::vector<ProjectionQuery> queries(n);
  for (std::size_t v = 0; v < n; ++v) {
    queries[v].point = remesh.positions[v];
    queries[v].hint = v < remesh.scan_triangle.size() ? remesh.scan_triangle[v] : kNoTriangle;
  }
  std::vector<SurfacePoint> points(n);
  projector.project(queries, points, graph);
  std::vector<std::uint32_t> order(n);
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return points[a].triangle != points[b].triangle ? points[a].triangle < points[b].triangle
                                                    : a < b;
  });
  remesh.colours.assign(n, Rgba{255, 255, 255, 255});

  struct State {
    ChunkView<LocalTriangle> triangles;
    ChunkView<Rgba> colours;
    std::span<const std::uint32_t> vertices;
  };
  run_pass<State>(
      graph, "colours", scan.layout.tile_count(),
      [&](TileId tile, State& s) {
        const TileTriangles& counts = scan.triangles[tile.value];
        const auto from = [&](std::uint64_t triangle) {
          return std::lower_bound(
              order.begin(), order.end(), triangle,
              [&](std::uint32_t v, std::uint64_t wanted) { return points[v].triangle < wanted; });
        };
        s.vertices =
            std::span<const std::uint32_t>(from(counts.first), from(counts.first + counts.owned));
        if (!s.vertices.empty()) {
          s.triangles = read(store, fields::kTriangle, tile);
          s.colours = read(store, fields::kColour, tile);
        }
      },
      [&](TileId tile, State& s) {
        const std::uint64_t first = scan.triangles[tile.value].first;
        for (const std::uint32_t v : s.vertices) {
          const LocalTriangle& t = s.triangles[points[v].triangle - first];
          const auto& w = points[v].weights;
          for (std::size_t c = 0; c < 4; ++c) {
            const double value =
                w[0] * s.colours[t[0]][c] + w[1] * s.colours[t[1]][c] + w[2] * s.colours[t[2]][c];
            remesh.colours[v][c] =
                static_cast<std::uint8_t>(std::clamp(std::floor(value + 0.5), 0.0, 255.0));
          }
        }
      },
      [](TileId, State&) {});
}

}  // namespace rattan
