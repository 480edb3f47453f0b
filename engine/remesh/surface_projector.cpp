// SPDX-License-Identifier: MIT
#include "engine/remesh/surface_projector.h"

#include <algorithm>
#include <cmath>

#include "engine/core/errors.h"
#include "engine/core/parallel.h"

namespace rattan {

namespace {

constexpr std::size_t kGroup = 32;
constexpr std::size_t kQueryGrain = 256;

double box_distance2(const Vec3d& p, const Vec3f& lo, const Vec3f& hi) {
  double sum = 0.0;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double out = std::max({double{lo[axis]} - p[axis], p[axis] - double{hi[axis]}, 0.0});
    sum += out * out;
  }
  return sum;
}

}  // namespace

/// The owned triangles of one tile, ready for queries.
struct SurfaceProjector::TileScene {
  explicit TileScene(const TileMesh& mesh)
      : positions(mesh.positions),
        triangles(mesh.triangles),
        index(positions.span(), triangles.span().first(mesh.counts.owned), mesh.counts.first) {}
  std::uint64_t bytes() const {
    return positions.span().size_bytes() + triangles.span().size_bytes() + index.bytes();
  }
  ChunkView<Vec3f> positions;
  ChunkView<LocalTriangle> triangles;
  TriangleIndex index;
};

SurfaceProjector::SurfaceProjector(Store& store, const ScanMesh& mesh,
                                   const ProjectorOptions& options, TaskGraph& graph)
    : store_(store), mesh_(mesh), options_(options) {
  if (options_.budget != nullptr) {
    reserved_ = options_.budget->reserve(0, "the index of the scan's triangles");
    most_alive_bytes_ = options_.budget->available() / 2;
  }
  const std::uint32_t tiles = mesh.layout.tile_count();
  boxes_.resize(tiles);
  alive_.resize(tiles);
  struct State {
    TileMesh mesh;
    std::shared_ptr<const TileScene> scene;
    Box box;
  };
  run_pass<State>(
      graph, "index", tiles, [&](TileId t, State& s) { s.mesh = load_tile(store_, mesh_, t); },
      [&](TileId t, State& s) {
        if (t.value < options_.tiles_alive) {
          s.scene = std::make_shared<const TileScene>(s.mesh);
          s.box = {s.scene->index.box_min(), s.scene->index.box_max()};
          return;
        }
        s.box.lo = Vec3f::Constant(std::numeric_limits<float>::infinity());
        s.box.hi = -s.box.lo;
        for (const LocalTriangle& c : s.mesh.triangles.span().first(s.mesh.counts.owned)) {
          for (const std::uint32_t v : c) {
            s.box.lo = s.box.lo.cwiseMin(s.mesh.positions[v]);
            s.box.hi = s.box.hi.cwiseMax(s.mesh.positions[v]);
          }
        }
      },
      [&](TileId t, State& s) {
        boxes_[t.value] = s.box;
        if (s.scene) {
          keep(t, std::move(s.scene));
        }
      });
  for (std::size_t first = 0; first < tiles; first += kGroup) {
    Box group = boxes_[first];
    for (std::size_t t = first + 1; t < std::min<std::size_t>(first + kGroup, tiles); ++t) {
      group.lo = group.lo.cwiseMin(boxes_[t].lo);
      group.hi = group.hi.cwiseMax(boxes_[t].hi);
    }
    group_boxes_.push_back(group);
  }
}

SurfaceProjector::~SurfaceProjector() = default;

std::shared_ptr<const SurfaceProjector::TileScene> SurfaceProjector::scene(TileId tile) {
  return alive_[tile.value];
}

void SurfaceProjector::keep(TileId tile, std::shared_ptr<const TileScene> scene) {
  // Passes are cyclic, where dropping the oldest would drop every scene just before it is needed:
  // the first ones stay and nothing is ever evicted.
  if (alive_[tile.value] || alive_count_ >= options_.tiles_alive) {
    return;
  }
  const std::uint64_t bytes = scene->bytes();
  if (alive_bytes_ + bytes > most_alive_bytes_) {
    return;
  }
  alive_bytes_ += bytes;
  if (options_.budget != nullptr) {
    reserved_.resize(alive_bytes_);
  }
  alive_[tile.value] = std::move(scene);
  ++alive_count_;
}

template <class F>
void SurfaceProjector::for_boxes_within(const Vec3d& p, double distance2, const F& f) const {
  for (std::size_t g = 0; g < group_boxes_.size(); ++g) {
    if (!(box_distance2(p, group_boxes_[g].lo, group_boxes_[g].hi) <= distance2)) {
      continue;
    }
    const std::size_t last = std::min((g + 1) * kGroup, boxes_.size());
    for (std::size_t t = g * kGroup; t < last; ++t) {
      if (box_distance2(p, boxes_[t].lo, boxes_[t].hi) <= distance2) {
        f(static_cast<std::uint32_t>(t));
      }
    }
  }
}

TileId SurfaceProjector::nearest_box(const Vec3d& p) const {
  double best = std::numeric_limits<double>::infinity();
  std::uint32_t tile = 0;
  for (std::size_t g = 0; g < group_boxes_.size(); ++g) {
    if (!(box_distance2(p, group_boxes_[g].lo, group_boxes_[g].hi) < best)) {
      continue;
    }
    const std::size_t last = std::min((g + 1) * kGroup, boxes_.size());
    for (std::size_t t = g * kGroup; t < last; ++t) {
      const double d2 = box_distance2(p, boxes_[t].lo, boxes_[t].hi);
      if (d2 < best) {
        best = d2;
        tile = static_cast<std::uint32_t>(t);
      }
    }
  }
  return TileId(tile);
}

void SurfaceProjector::run(const char* name, const Bins& bins,
                           std::span<const ProjectionQuery> queries,
                           std::span<SurfacePoint> results, TaskGraph& graph) {
  std::vector<std::uint32_t> active;
  for (std::uint32_t t = 0; t < mesh_.layout.tile_count(); ++t) {
    if (bins.begin[t + 1] > bins.begin[t]) {
      active.push_back(t);
    }
  }
  // What earlier passes found bounds the search. Results change at commit, while other tiles
  // compute.
  std::vector<ClosestHit> bounds(queries.size());
  for (std::size_t i = 0; i < queries.size(); ++i) {
    bounds[i] = {results[i].distance2, results[i].triangle};
  }
  struct State {
    TileMesh mesh;
    std::shared_ptr<const TileScene> scene;
    std::vector<std::uint32_t> order;
    std::vector<SurfacePoint> found;
  };
  run_pass<State>(
      graph, name, static_cast<std::uint32_t>(active.size()),
      [&](TileId k, State& s) {
        const TileId tile(active[k.value]);
        s.scene = scene(tile);
        if (!s.scene) {
          s.mesh = load_tile(store_, mesh_, tile);
        }
      },
      [&](TileId k, State& s) {
        if (!s.scene) {
          s.scene = std::make_shared<const TileScene>(s.mesh);
          s.mesh = {};
        }
        const TriangleIndex& index = s.scene->index;
        const std::uint64_t begin = bins.begin[active[k.value]];
        const std::uint64_t count = bins.begin[active[k.value] + 1] - begin;
        // Neighbours in the scan one after another, so that they find the hierarchy in the cache.
        s.order.assign(bins.query.begin() + static_cast<std::ptrdiff_t>(begin),
                       bins.query.begin() + static_cast<std::ptrdiff_t>(begin + count));
        std::sort(s.order.begin(), s.order.end(), [&](std::uint32_t a, std::uint32_t b) {
          return queries[a].hint != queries[b].hint ? queries[a].hint < queries[b].hint : a < b;
        });
        s.found.resize(count);
        parallel_indices(
            count,
            [&](std::size_t i) {
              const std::uint32_t q = s.order[i];
              const ProjectionQuery& query = queries[q];
              ClosestHit hit = bounds[q];
              if (query.hint - index.base() < index.triangles().size()) {
                index.try_triangle(query.point,
                                   static_cast<std::uint32_t>(query.hint - index.base()), hit);
              }
              index.closest(query.point, hit);
              if (hit.triangle - index.base() < index.triangles().size()) {
                const auto local = static_cast<std::uint32_t>(hit.triangle - index.base());
                const ClosestOnTriangle c = index.evaluate(query.point, local);
                s.found[i] = {c.point, index.normal(local), c.weights, hit.triangle, c.distance2};
              }
            },
            kQueryGrain);
      },
      [&](TileId k, State& s) {
        for (std::size_t i = 0; i < s.found.size(); ++i) {
          SurfacePoint& best = results[s.order[i]];
          const ClosestHit so_far{best.distance2, best.triangle};
          if (s.found[i].found() && so_far.better(s.found[i].distance2, s.found[i].triangle)) {
            best = s.found[i];
          }
        }
        keep(TileId(active[k.value]), std::move(s.scene));
      });
}

void SurfaceProjector::project(std::span<const ProjectionQuery> queries,
                               std::span<SurfacePoint> results, TaskGraph& graph) {
  ensure(queries.size() == results.size(), "one result a query");
  ensure(queries.size() < 0xffffffffU, "queries are numbered in 32 bits");
  queries_ += queries.size();
  const std::uint32_t tiles = mesh_.layout.tile_count();
  const std::size_t n = queries.size();

  // First the tile that the hint or the boxes suggest: it nearly always holds the answer.
  std::vector<std::uint32_t> home(n);
  parallel_indices(n, [&](std::size_t i) {
    const std::uint64_t hint = queries[i].hint;
    if (hint < mesh_.topology.triangles) {
      const auto after =
          std::upper_bound(mesh_.triangles.begin(), mesh_.triangles.end(), hint,
                           [](std::uint64_t id, const TileTriangles& t) { return id < t.first; });
      home[i] = static_cast<std::uint32_t>(after - mesh_.triangles.begin() - 1);
    } else {
      home[i] = nearest_box(queries[i].point).value;
    }
    results[i] = SurfacePoint{};
    results[i].distance2 = queries[i].radius * queries[i].radius;
  });
  Bins bins;
  bins.begin.assign(tiles + 1, 0);
  for (const std::uint32_t t : home) {
    ++bins.begin[t + 1];
  }
  for (std::uint32_t t = 0; t < tiles; ++t) {
    bins.begin[t + 1] += bins.begin[t];
  }
  bins.query.resize(n);
  std::vector<std::uint64_t> fill(bins.begin.begin(), bins.begin.end() - 1);
  for (std::size_t i = 0; i < n; ++i) {
    bins.query[fill[home[i]]++] = static_cast<std::uint32_t>(i);
  }
  run("project", bins, queries, results, graph);
  if (tiles == 1) {
    return;
  }

  // Then every other tile whose box is within reach of what was found. Boxes are exact floats; the
  // factor covers the rounding of both distances.
  const auto reach = [&](std::size_t i) { return results[i].distance2 * (1.0 + 1e-9); };
  const std::size_t grain = kParallelGrain;
  const std::size_t chunks = (n + grain - 1) / grain;
  std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> pairs(chunks);
  parallel_chunks(
      n,
      [&](std::size_t begin, std::size_t end) {
        auto& mine = pairs[begin / grain];
        for (std::size_t i = begin; i < end; ++i) {
          for_boxes_within(queries[i].point, reach(i), [&](std::uint32_t t) {
            if (t != home[i]) {
              mine.emplace_back(t, static_cast<std::uint32_t>(i));
            }
          });
        }
      },
      grain);
  bins.begin.assign(tiles + 1, 0);
  for (const auto& chunk : pairs) {
    for (const auto& [t, i] : chunk) {
      ++bins.begin[t + 1];
    }
  }
  for (std::uint32_t t = 0; t < tiles; ++t) {
    bins.begin[t + 1] += bins.begin[t];
  }
  bins.query.resize(bins.begin[tiles]);
  fill.assign(bins.begin.begin(), bins.begin.end() - 1);
  for (const auto& chunk : pairs) {
    for (const auto& [t, i] : chunk) {
      bins.query[fill[t]++] = i;
    }
  }
  if (!bins.query.empty()) {
    run("project borders", bins, queries, results, graph);
  }
}

}  // namespace rattan
