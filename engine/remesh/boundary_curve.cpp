// SPDX-License-Identifier: MIT
#include "engine/remesh/boundary_curve.h"

#include <algorithm>
#include <array>
#include <numeric>

namespace rattan {

namespace {

/// A side of a triangle whose lower vertex is owned; ends in tile-local numbers.
struct Side {
  std::uint64_t lo;
  std::uint64_t hi;
  std::uint32_t local_lo;
  std::uint32_t local_hi;
  bool reversed;  ///< the triangle runs from hi to lo
  bool operator<(const Side& o) const { return lo != o.lo ? lo < o.lo : hi < o.hi; }
};

std::uint32_t root(std::vector<std::uint32_t>& parent, std::uint32_t v) {
  while (parent[v] != v) {
    parent[v] = parent[parent[v]];
    v = parent[v];
  }
  return v;
}

}  // namespace

BoundaryCurve::BoundaryCurve(Store& store, const ScanMesh& mesh, TaskGraph& graph) {
  struct State {
    ChunkView<std::uint8_t> flags;
    TileMesh mesh;
    bool any = false;
    std::vector<Side> sides;
  };
  std::vector<std::array<std::uint64_t, 2>> edges;
  run_pass<State>(
      graph, "boundary", mesh.layout.tile_count(),
      [&](TileId t, State& s) {
        s.flags = read(store, fields::kVertexFlag, t);
        s.any = std::any_of(s.flags.begin(), s.flags.end(),
                            [](std::uint8_t f) { return (f & kOnBoundary) != 0; });
        if (s.any) {
          s.mesh = load_tile(store, mesh, t);
        }
      },
      [&](TileId, State& s) {
        if (!s.any) {
          return;
        }
        // Both triangles of an edge touch its lower vertex, hence are in the tile that owns it.
        for (const LocalTriangle& t : s.mesh.triangles) {
          for (std::size_t c = 0; c < 3; ++c) {
            std::uint32_t a = t[c];
            std::uint32_t b = t[(c + 1) % 3];
            const bool reversed = s.mesh.global_id(a) > s.mesh.global_id(b);
            if (reversed) {
              std::swap(a, b);
            }
            if (a < s.mesh.extent.owned && (s.flags[a] & kOnBoundary) != 0) {
              s.sides.push_back({s.mesh.global_id(a), s.mesh.global_id(b), a, b, reversed});
            }
          }
        }
        std::sort(s.sides.begin(), s.sides.end());
        std::size_t kept = 0;
        for (std::size_t i = 0; i < s.sides.size();) {
          std::size_t j = i + 1;
          while (j < s.sides.size() && !(s.sides[i] < s.sides[j])) {
            ++j;
          }
          if (j == i + 1) {
            s.sides[kept++] = s.sides[i];
          }
          i = j;
        }
        s.sides.resize(kept);
      },
      [&](TileId, State& s) {
        for (const Side& side : s.sides) {
          edges.push_back({side.lo, side.hi});
          reversed_.push_back(side.reversed ? 1 : 0);
          ends_.push_back(s.mesh.positions[side.local_lo]);
          ends_.push_back(s.mesh.positions[side.local_hi]);
        }
      });

  std::vector<std::uint64_t> ids;
  ids.reserve(2 * edges.size());
  for (const auto& e : edges) {
    ids.insert(ids.end(), {e[0], e[1]});
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  const auto rank = [&](std::uint64_t id) {
    return static_cast<std::uint32_t>(std::lower_bound(ids.begin(), ids.end(), id) - ids.begin());
  };
  std::vector<std::uint32_t> parent(ids.size());
  std::iota(parent.begin(), parent.end(), 0U);
  for (const auto& e : edges) {
    const std::uint32_t a = root(parent, rank(e[0]));
    const std::uint32_t b = root(parent, rank(e[1]));
    parent[std::max(a, b)] = std::min(a, b);
  }
  // Loops are numbered by their lowest vertex.
  std::vector<std::uint32_t> number(ids.size(), 0);
  for (std::uint32_t v = 0; v < parent.size(); ++v) {
    if (root(parent, v) == v) {
      number[v] = loops_++;
    }
  }
  for (std::uint32_t i = 0; i < edges.size(); ++i) {
    segments_.push_back({2 * i, 2 * i + 1, 2 * i});
    loop_.push_back(number[root(parent, rank(edges[i][0]))]);
    const bool r = reversed_[i] != 0;
    path_.push_back({rank(edges[i][r ? 1 : 0]), rank(edges[i][r ? 0 : 1])});
  }
  index_ = std::make_unique<TriangleIndex>(ends_, segments_, 0, loop_);
}

std::vector<std::vector<Vec3d>> BoundaryCurve::loops() const {
  constexpr std::uint32_t kNone = 0xffffffffU;
  std::uint32_t vertices = 0;
  for (const auto& p : path_) {
    vertices = std::max({vertices, p[0] + 1, p[1] + 1});
  }
  std::vector<std::uint32_t> out(vertices, kNone);  // the segment that leaves each vertex
  for (std::uint32_t i = 0; i < path_.size(); ++i) {
    out[path_[i][0]] = i;
  }
  std::vector<std::vector<Vec3d>> result(loops_);
  std::vector<std::uint8_t> used(path_.size(), 0);
  for (std::uint32_t i = 0; i < path_.size(); ++i) {
    if (!result[loop_[i]].empty()) {
      continue;
    }
    for (std::uint32_t at = i; at != kNone && used[at] == 0; at = out[path_[at][1]]) {
      used[at] = 1;
      result[loop_[i]].push_back(ends_[2 * at + reversed_[at]].cast<double>());
    }
  }
  return result;
}

BoundaryCurve::Point BoundaryCurve::result(const Vec3d& p, const ClosestHit& hit) const {
  if (hit.triangle == kNoTriangle) {
    return {};
  }
  const auto segment = static_cast<std::uint32_t>(hit.triangle);
  return {index_->evaluate(p, segment).point, loop_[segment], true};
}

BoundaryCurve::Point BoundaryCurve::closest(const Vec3d& p) const {
  ClosestHit hit;
  index_->closest(p, hit);
  return result(p, hit);
}

BoundaryCurve::Point BoundaryCurve::closest_on_loop(const Vec3d& p, std::uint32_t loop) const {
  ClosestHit hit;
  index_->closest_labelled(p, loop, hit);
  return result(p, hit);
}

}  // namespace rattan
