// SPDX-License-Identifier: MIT
#include "engine/layout/geodesic_path.h"

#include <algorithm>
#include <array>

#include "engine/core/errors.h"
#include "engine/layout/sleeve.h"
#include "engine/layout/surface_search.h"

namespace rattan::layout {

namespace {

/// Of an edge: what is nearer to its end goes through the vertex there, if the path gets no longer
/// than by kDetour. The last is always taken: triangles have to be that wide.
constexpr std::array<double, 4> kNearVertex{0.1, 0.03, 0.01, 0.001};
constexpr double kDetour = 1.005;
constexpr int kSnapRounds = 3;
/// Of what a flip must save, beyond rounding.
constexpr double kGain = 1e-12;

using Node = SurfaceSearch::Node;

/// Turns a way over vertices and middles of edges into the sleeve around it; shares on that way.
class SleeveOfWay {
 public:
  SleeveOfWay(const CutMesh& mesh, const SurfaceSearch& search, const std::vector<Node>& way)
      : mesh_(mesh), search_(search), way_(way) {}

  Sleeve make() {
    for (std::size_t i = 1; i + 1 < way_.size(); ++i) {
      if (search_.is_vertex(way_[i])) {
        pass_vertex(i);
      } else {
        cross_edge(i);
      }
    }
    return std::move(sleeve_);
  }

 private:
  enum class Side : std::uint8_t { kNone, kLeft, kRight };

  void cross(HalfedgeHandle h, double share) {
    sleeve_.crossed.push_back(h);
    sleeve_.share.push_back(share);
  }

  /// The half of edge node `n` in the triangle that it shares with `neighbour`.
  HalfedgeHandle half_towards(Node n, Node neighbour) const {
    for (int side = 0; side < 2; ++side) {
      const HalfedgeHandle h = mesh_.halfedge_handle(search_.edge(n), side);
      if (mesh_.is_boundary(h)) {
        continue;
      }
      const HalfedgeHandle second = mesh_.next(h);
      if (search_.is_vertex(neighbour)
              ? mesh_.to_vertex_handle(second) == search_.vertex(neighbour)
              : mesh_.edge_handle(second) == search_.edge(neighbour) ||
                    mesh_.edge_handle(mesh_.next(second)) == search_.edge(neighbour)) {
        return h;
      }
    }
    throw InternalError("next points of a way share a triangle");
  }

  void cross_edge(std::size_t i) {
    const HalfedgeHandle in = half_towards(way_[i], way_[i - 1]);
    if (in != half_towards(way_[i], way_[i + 1])) {
      cross(in, 0.5);
    }
    side_ = Side::kNone;
  }

  /// Directions around a vertex, counter-clockwise: 2 k along its k-th edge, 2 k + 1 in the
  /// triangle behind that.
  std::size_t direction(Node towards, Node vertex) const {
    for (std::size_t k = 0; k < rays_.size(); ++k) {
      if (search_.is_vertex(towards)) {
        if (mesh_.to_vertex_handle(rays_[k]) == search_.vertex(towards)) {
          return 2 * k;
        }
      } else if (mesh_.face_handle(rays_[k]) == mesh_.face_handle(half_towards(towards, vertex))) {
        return 2 * k + 1;
      }
    }
    throw InternalError("next points of a way share a triangle");
  }

  void pass_vertex(std::size_t i) {
    const VertexHandle v = search_.vertex(way_[i]);
    rays_.clear();
    const HalfedgeHandle first = mesh_.halfedge_handle(v);
    HalfedgeHandle ray = first;
    do {
      rays_.push_back(ray);
      ray = mesh_.opposite(mesh_.next(mesh_.next(ray)));
    } while (ray != first);
    const std::size_t around = 2 * rays_.size();
    const std::size_t in = direction(way_[i - 1], way_[i]);
    const std::size_t out = direction(way_[i + 1], way_[i]);
    // Counter-clockwise from where it comes to where it goes is on its right.
    const std::size_t right = (out + around - in) % around;
    const Side side = right * 2 < around                             ? Side::kRight
                      : right * 2 == around && side_ == Side::kRight ? Side::kRight
                                                                     : Side::kLeft;
    if (side_ != Side::kNone && side_ != side) {
      // It came along an edge, from a vertex passed on the other side.
      const HalfedgeHandle back = rays_[in / 2];
      cross(side_ == Side::kRight ? back : mesh_.opposite(back), side_ == Side::kRight ? 0.0 : 1.0);
    }
    if (side == Side::kRight) {
      for (std::size_t d = in + 1; d < in + right; ++d) {
        if (d % 2 == 0) {
          cross(mesh_.opposite(rays_[d % around / 2]), 1.0);
        }
      }
    } else {
      for (std::size_t d = in + around - 1; d > in + right; --d) {
        if (d % 2 == 0) {
          cross(rays_[d % around / 2], 0.0);
        }
      }
    }
    side_ = search_.is_vertex(way_[i + 1]) ? side : Side::kNone;
  }

  const CutMesh& mesh_;
  const SurfaceSearch& search_;
  const std::vector<Node>& way_;
  std::vector<HalfedgeHandle> rays_;
  Side side_ = Side::kNone;  ///< on which the last vertex was passed, if the way follows an edge
  Sleeve sleeve_;
};

/// Passes vertices on the other side as long as that helps.
void straighten(SleevePaths& paths, Sleeve& s, std::size_t most) {
  Sleeve trial;
  bool better = true;
  while (better) {
    better = false;
    for (std::size_t b = 0; b < s.bend.size();) {
      if (most > 0 && paths.flip(s, s.bend[b], trial)) {
        paths.pull(trial);
        if (trial.length < s.length * (1.0 - kGain)) {
          std::swap(s, trial);
          better = true;
          --most;
          continue;  // the next bend has come to this place, or the same with less of a bend
        }
      }
      ++b;
    }
  }
}

/// Through vertices that are nearer than `near` of an edge.
Sleeve snapped(SleevePaths& paths, Sleeve s, double near) {
  for (int round = 0; round < kSnapRounds; ++round) {
    bool held = false;
    for (std::size_t i = 0; i < s.crossed.size(); ++i) {
      auto& [low, high] = s.gate[i];
      if (low == 0 && high != 0 && s.share[i] <= near) {
        high = 0;
        held = true;
      } else if (high == 1 && low != 1 && s.share[i] >= 1.0 - near) {
        low = 1;
        held = true;
      }
    }
    if (!held) {
      break;
    }
    paths.pull(s);
  }
  for (std::size_t i = 0; i < s.crossed.size(); ++i) {
    if (s.gate[i][0] == 0 && s.share[i] <= near) {
      s.share[i] = 0;
    } else if (s.gate[i][1] == 1 && s.share[i] >= 1.0 - near) {
      s.share[i] = 1;
    }
  }
  paths.measure(s);
  return s;
}

std::vector<PathPoint> points_of(const CutMesh& mesh, const Sleeve& s, VertexHandle from,
                                 VertexHandle to) {
  std::vector<PathPoint> path{{from, HalfedgeHandle(), 0}};
  const auto meets = [&](const PathPoint& p, VertexHandle v) {
    return !p.at_vertex() &&
           (mesh.from_vertex_handle(p.halfedge) == v || mesh.to_vertex_handle(p.halfedge) == v);
  };
  const auto add_vertex = [&](VertexHandle v) {
    const auto seen =
        std::find_if(path.begin(), path.end(), [&](const PathPoint& p) { return p.vertex == v; });
    if (seen != path.end()) {
      path.erase(seen + 1, path.end());
      return;
    }
    // What is in an edge of the vertex can reach it, and be skipped, at once: they share both
    // triangles beside that edge.
    while (meets(path.back(), v)) {
      path.pop_back();
    }
    path.push_back({v, HalfedgeHandle(), 0});
  };
  for (std::size_t i = 0; i < s.crossed.size(); ++i) {
    const HalfedgeHandle h = s.crossed[i];
    if (s.share[i] == 0) {
      add_vertex(mesh.from_vertex_handle(h));
    } else if (s.share[i] == 1) {
      add_vertex(mesh.to_vertex_handle(h));
    } else {
      const PathPoint p{VertexHandle(), h, s.share[i]};
      if (!path.back().at_vertex() || !meets(p, path.back().vertex)) {
        path.push_back(p);
      }
    }
  }
  add_vertex(to);
  return path;
}

}  // namespace

std::vector<PathPoint> geodesic_path(const CutMesh& mesh, VertexHandle from, VertexHandle to) {
  SurfaceSearch search(mesh);
  const std::array<SurfaceSearch::Source, 1> source{{{search.node(to), 0.0}}};
  search.run(source, search.node(from));
  std::vector<Node> way;
  for (Node n = search.node(from); n != SurfaceSearch::kNone; n = search.towards_source(n)) {
    way.push_back(n);
  }
  ensure(way.back() == search.node(to), "walls leave a way from the centre to every middle");

  SleevePaths paths(mesh, from, to);
  Sleeve first = SleeveOfWay(mesh, search, way).make();
  paths.tidy(first);
  paths.measure(first);
  Sleeve straight = first;
  paths.open_gates(straight);
  paths.pull(straight);
  straighten(paths, straight, 4 * mesh.n_faces());
  for (const double near : kNearVertex) {
    const Sleeve s = snapped(paths, straight, near);
    if (s.length <= kDetour * straight.length || near == kNearVertex.back()) {
      // Where walls are close, what keeps off them may be longer than the way to begin with.
      return points_of(mesh, s.length <= first.length ? s : first, from, to);
    }
  }
  return {};
}

std::vector<VertexHandle> cut_along(CutMesh& mesh, const std::vector<PathPoint>& path) {
  std::vector<VertexHandle> vertices;
  vertices.reserve(path.size());
  for (const PathPoint& p : path) {
    vertices.push_back(p.at_vertex() ? p.vertex : mesh.cut_edge(p.halfedge, p.share));
  }
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    mesh.make_wall(vertices[i]);
    if (i > 0) {
      const HalfedgeHandle h = mesh.find_halfedge(vertices[i - 1], vertices[i]);
      ensure(h.is_valid(), "a cut path consists of edges");
      mesh.make_wall(mesh.edge_handle(h));
    }
  }
  return vertices;
}

}  // namespace rattan::layout
