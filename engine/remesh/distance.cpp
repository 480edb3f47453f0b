// SPDX-License-Identifier: MIT
#include "engine/remesh/distance.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/core/errors.h"
#include "engine/core/parallel.h"
#include "engine/remesh/triangle_index.h"

namespace rattan {

namespace {

struct Summary {
  double max = 0.0;
  double sum = 0.0;
  double squares = 0.0;
  std::uint64_t count = 0;

  void add(double distance2) {
    const double d = std::sqrt(distance2);
    max = std::max(max, d);
    sum += d;
    squares += distance2;
    ++count;
  }
  double mean() const { return count > 0 ? sum / static_cast<double>(count) : 0.0; }
  double rms() const { return count > 0 ? std::sqrt(squares / static_cast<double>(count)) : 0.0; }
};

/// The remesh as triangles over float positions, in an order that makes the index tight.
struct Triangulated {
  std::vector<Vec3f> positions;
  std::vector<LocalTriangle> triangles;

  explicit Triangulated(const PolygonMesh& mesh) {
    positions.reserve(mesh.vertex_count());
    for (const Vec3d& p : mesh.positions) {
      positions.push_back(p.cast<float>());
    }
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
      const auto c = mesh.face(f);
      if (c.size() == 4 && (mesh.positions[c[1]] - mesh.positions[c[3]]).squaredNorm() <
                               (mesh.positions[c[0]] - mesh.positions[c[2]]).squaredNorm()) {
        triangles.push_back({c[1], c[2], c[3]});
        triangles.push_back({c[1], c[3], c[0]});
        continue;
      }
      for (std::size_t k = 1; k + 1 < c.size(); ++k) {
        triangles.push_back({c[0], c[k], c[k + 1]});
      }
    }
    sort();
  }

  void sort() {
    std::vector<Item> items;
    items.reserve(triangles.size());
    for (const LocalTriangle& t : triangles) {
      items.push_back({positions[t[0]] + positions[t[1]] + positions[t[2]], t});
    }
    split(items);
    for (std::size_t i = 0; i < items.size(); ++i) {
      triangles[i] = items[i].triangle;
    }
  }

 private:
  struct Item {
    Vec3f centre;  ///< times three
    LocalTriangle triangle;
  };

  /// Median splits along the longest axis, at multiples of the sizes of the index's nodes.
  static void split(std::span<Item> items) {
    if (items.size() <= 8) {
      return;
    }
    std::size_t unit = 8;
    while (8 * unit < items.size()) {
      unit *= 8;
    }
    const std::size_t half = (items.size() + unit - 1) / unit / 2 * unit;
    Vec3f lo = items.front().centre;
    Vec3f hi = lo;
    for (const Item& i : items) {
      lo = lo.cwiseMin(i.centre);
      hi = hi.cwiseMax(i.centre);
    }
    Eigen::Index axis = 0;
    (hi - lo).maxCoeff(&axis);
    std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(half), items.end(),
                     [axis](const Item& a, const Item& b) {
                       return a.centre[axis] != b.centre[axis] ? a.centre[axis] < b.centre[axis]
                                                               : a.triangle < b.triangle;
                     });
    split(items.first(half));
    split(items.subspan(half));
  }
};

Summary scan_to_remesh(const PolygonMesh& remesh, Store& store, const ScanMesh& scan,
                       std::uint32_t stride, TaskGraph& graph) {
  const Triangulated flat(remesh);
  const TriangleIndex index(flat.positions, flat.triangles);
  struct State {
    ChunkView<Vec3f> positions;
    std::vector<double> distance2;
  };
  Summary summary;
  run_pass<State>(
      graph, "distance", scan.layout.tile_count(),
      [&](TileId t, State& s) { s.positions = read(store, fields::kPosition, t); },
      [&](TileId t, State& s) {
        const TileExtent& e = scan.layout.tiles[t.value];
        // Sampled by global number, so that tiles don't matter.
        const std::uint64_t first = (e.first + stride - 1) / stride * stride - e.first;
        const std::uint64_t count = e.owned > first ? (e.owned - first + stride - 1) / stride : 0;
        s.distance2.resize(count);
        parallel_chunks(
            count,
            [&](std::size_t begin, std::size_t end) {
              // Neighbours in the list are near each other: the last answer bounds the next search.
              std::uint64_t last = kNoTriangle;
              for (std::size_t i = begin; i < end; ++i) {
                const Vec3d p = s.positions[first + i * stride].cast<double>();
                ClosestHit hit;
                if (last != kNoTriangle) {
                  index.try_triangle(p, static_cast<std::uint32_t>(last), hit);
                }
                index.closest(p, hit);
                last = hit.triangle;
                s.distance2[i] = hit.distance2;
              }
            },
            1024);
      },
      [&](TileId, State& s) {
        for (const double d2 : s.distance2) {
          summary.add(d2);
        }
      });
  return summary;
}

Summary remesh_to_scan(const PolygonMesh& remesh, SurfaceProjector& projector, TaskGraph& graph) {
  std::vector<ProjectionQuery> queries;
  const bool hints = remesh.scan_triangle.size() == remesh.vertex_count();
  const auto hint = [&](std::uint32_t v) { return hints ? remesh.scan_triangle[v] : kNoTriangle; };
  const double infinity = std::numeric_limits<double>::infinity();
  for (std::uint32_t v = 0; v < remesh.vertex_count(); ++v) {
    queries.push_back({remesh.positions[v], infinity, hint(v)});
  }
  for (std::size_t f = 0; f < remesh.face_count(); ++f) {
    const auto c = remesh.face(f);
    Vec3d centre = Vec3d::Zero();
    for (const std::uint32_t v : c) {
      centre += remesh.positions[v];
    }
    queries.push_back({centre / static_cast<double>(c.size()), infinity, hint(c[0])});
  }
  std::vector<SurfacePoint> found(queries.size());
  projector.project(queries, found, graph);
  Summary summary;
  for (const SurfacePoint& p : found) {
    summary.add(p.distance2);
  }
  return summary;
}

}  // namespace

DistanceReport measure_distances(const PolygonMesh& remesh, Store& store, const ScanMesh& scan,
                                 SurfaceProjector& projector, const DistanceOptions& options,
                                 TaskGraph& graph) {
  ensure(options.scan_stride > 0, "the stride is positive");
  DistanceReport r;
  r.diagonal = scan.diagonal();
  if (remesh.face_count() == 0 || scan.topology.triangles == 0) {
    return r;
  }
  const Summary from = scan_to_remesh(remesh, store, scan, options.scan_stride, graph);
  const Summary to = remesh_to_scan(remesh, projector, graph);
  r.to_input_max = to.max;
  r.to_input_rms = to.rms();
  r.to_input_mean = to.mean();
  r.from_input_max = from.max;
  r.from_input_rms = from.rms();
  r.from_input_mean = from.mean();
  r.remesh_samples = to.count;
  r.scan_samples = from.count;
  r.scan_share = static_cast<double>(from.count) / static_cast<double>(scan.layout.node_count);
  return r;
}

}  // namespace rattan
