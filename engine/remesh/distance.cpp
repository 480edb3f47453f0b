// SPDX-License-Identifier: MIT
#include "engine/remesh/distance.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/core/errors.h"
#include "engine/core/parallel.h"
#include "engine/remesh/distance_summary.h"
#include "engine/remesh/surface_samples.h"
#include "engine/remesh/triangle_index.h"

namespace rattan {

namespace {

/// Figures over samples, maximum over all points.
struct Measured {
  DistanceSummary vertices;
  DistanceSummary samples;

  OneWayDistances figures() const {
    const DistanceSummary& s = samples.count() > 0 ? samples : vertices;
    return {s.mean(),
            s.rms(),
            s.quantile(0.99),
            std::max(vertices.max(), samples.max()),
            vertices.count() + samples.count(),
            s.count()};
  }
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
      for_face_triangles(mesh, f, [&](const LocalTriangle& t) { triangles.push_back(t); });
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

Measured scan_to_remesh(const PolygonMesh& remesh, Store& store, const ScanMesh& scan,
                        const DistanceOptions& options, TaskGraph& graph) {
  const Triangulated flat(remesh);
  const TriangleIndex index(flat.positions, flat.triangles);
  const std::uint64_t stride = options.scan_stride;
  const double density = sample_density(options.samples, scan.area);
  struct State {
    TileMesh mesh;
    std::size_t vertices = 0;  ///< of the points; the others are samples
    std::vector<Vec3d> points;
    std::vector<double> distance2;
  };
  Measured measured;
  run_pass<State>(
      graph, "distance", scan.layout.tile_count(),
      [&](TileId t, State& s) { s.mesh = load_tile(store, scan, t); },
      [&](TileId t, State& s) {
        const TileExtent& e = scan.layout.tiles[t.value];
        // Chosen by global number, so that tiles don't matter.
        for (std::uint64_t v = (e.first + stride - 1) / stride * stride - e.first; v < e.owned;
             v += stride) {
          s.points.push_back(s.mesh.positions[v].cast<double>());
        }
        s.vertices = s.points.size();
        for (std::uint32_t i = 0; density > 0.0 && i < s.mesh.counts.owned; ++i) {
          const LocalTriangle& c = s.mesh.triangles[i];
          sample_triangle(s.mesh.counts.first + i, s.mesh.positions[c[0]].cast<double>(),
                          s.mesh.positions[c[1]].cast<double>(),
                          s.mesh.positions[c[2]].cast<double>(), density, s.points);
        }
        s.distance2.resize(s.points.size());
        parallel_chunks(
            s.points.size(),
            [&](std::size_t begin, std::size_t end) {
              // Neighbours in the list are near each other: the last answer bounds the next search.
              std::uint64_t last = kNoTriangle;
              for (std::size_t i = begin; i < end; ++i) {
                ClosestHit hit;
                if (last != kNoTriangle) {
                  index.try_triangle(s.points[i], static_cast<std::uint32_t>(last), hit);
                }
                index.closest(s.points[i], hit);
                last = hit.triangle;
                s.distance2[i] = hit.distance2;
              }
            },
            1024);
      },
      [&](TileId, State& s) {
        for (std::size_t i = 0; i < s.points.size(); ++i) {
          (i < s.vertices ? measured.vertices : measured.samples).add(s.distance2[i]);
        }
      });
  return measured;
}

Measured remesh_to_scan(const PolygonMesh& remesh, SurfaceProjector& projector,
                        const DistanceOptions& options, TaskGraph& graph) {
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
  const std::size_t vertices = queries.size();
  if (options.samples > 0) {
    double area = 0.0;
    for (std::size_t f = 0; f < remesh.face_count(); ++f) {
      for_face_triangles(remesh, f, [&](const LocalTriangle& t) {
        area +=
            triangle_area(remesh.positions[t[0]], remesh.positions[t[1]], remesh.positions[t[2]]);
      });
    }
    const double density = sample_density(options.samples, area);
    std::vector<Vec3d> points;
    std::uint64_t number = 0;
    for (std::size_t f = 0; density > 0.0 && f < remesh.face_count(); ++f) {
      for_face_triangles(remesh, f, [&](const LocalTriangle& t) {
        points.clear();
        sample_triangle(number++, remesh.positions[t[0]], remesh.positions[t[1]],
                        remesh.positions[t[2]], density, points);
        for (const Vec3d& p : points) {
          queries.push_back({p, infinity, hint(t[0])});
        }
      });
    }
  }
  std::vector<SurfacePoint> found(queries.size());
  projector.project(queries, found, graph);
  Measured measured;
  for (std::size_t i = 0; i < found.size(); ++i) {
    (i < vertices ? measured.vertices : measured.samples).add(found[i].distance2);
  }
  return measured;
}

}  // namespace

DistanceReport measure_distances(const PolygonMesh& remesh, Store& store, const ScanMesh& scan,
                                 SurfaceProjector& projector, const DistanceOptions& options,
                                 TaskGraph& graph) {
  ensure(options.scan_stride > 0, "the stride is positive");
  DistanceReport r;
  r.diagonal = scan.diagonal() * scan.unit;
  if (remesh.face_count() == 0 || scan.topology.triangles == 0) {
    return r;
  }
  r.from_input = scan_to_remesh(remesh, store, scan, options, graph).figures();
  r.to_input = remesh_to_scan(remesh, projector, options, graph).figures();
  for (OneWayDistances* d : {&r.from_input, &r.to_input}) {
    for (double* length : {&d->mean, &d->rms, &d->p99, &d->max}) {
      *length *= scan.unit;
    }
  }
  const std::uint64_t vertices = scan.layout.node_count;
  const std::uint64_t measured = (vertices + options.scan_stride - 1) / options.scan_stride;
  r.scan_share = static_cast<double>(measured) / static_cast<double>(vertices);
  return r;
}

}  // namespace rattan
