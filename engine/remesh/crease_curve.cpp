// SPDX-License-Identifier: MIT
#include "engine/remesh/crease_curve.h"

#include <algorithm>
#include <tuple>

namespace rattan {

CreaseCurve::CreaseCurve(const FeatureSet* features) {
  if (features == nullptr || features->crease_edges() == 0) {
    return;
  }
  for (const FeatureEdge& e : features->edges()) {
    if (!e.boundary) {
      const auto i = static_cast<std::uint32_t>(ends_.size());
      ends_.push_back(e.p_lo);
      ends_.push_back(e.p_hi);
      segments_.push_back({i, i + 1, i});
      curve_.push_back(e.curve);
    }
  }
  index_ = std::make_unique<TriangleIndex>(ends_, segments_, 0, curve_);
  list_ends(*features);
}

namespace {

std::array<double, 6> pair_of(const Vec3d& p, const Vec3d& q) {
  const std::array a{p.x(), p.y(), p.z()};
  const std::array b{q.x(), q.y(), q.z()};
  const auto [low, high] = std::minmax({a, b});
  return {low[0], low[1], low[2], high[0], high[1], high[2]};
}

}  // namespace

void CreaseCurve::list_ends(const FeatureSet& features) {
  struct End {
    std::uint32_t curve;
    std::uint64_t vertex;
    Vec3f position;
  };
  std::vector<End> all;
  for (const FeatureEdge& e : features.edges()) {
    if (!e.boundary) {
      all.push_back({e.curve, e.lo, e.p_lo});
      all.push_back({e.curve, e.hi, e.p_hi});
    }
  }
  std::sort(all.begin(), all.end(), [](const End& x, const End& y) {
    return std::tie(x.curve, x.vertex) < std::tie(y.curve, y.vertex);
  });
  std::vector<Vec3d> ends;  // of the curve at hand: what only one of its edges has
  for (std::size_t i = 0; i < all.size();) {
    std::size_t j = i + 1;
    while (j < all.size() && all[j].curve == all[i].curve && all[j].vertex == all[i].vertex) {
      ++j;
    }
    if (j - i == 1) {
      ends.push_back(all[i].position.cast<double>());
    }
    if (j == all.size() || all[j].curve != all[i].curve) {
      if (ends.size() == 2) {
        between_.push_back({pair_of(ends[0], ends[1]), all[i].curve});
      }
      ends.clear();
    }
    i = j;
  }
  std::sort(between_.begin(), between_.end(), [](const Ends& x, const Ends& y) {
    return std::tie(x.points, x.curve) < std::tie(y.points, y.curve);
  });
}

std::uint32_t CreaseCurve::between(const Vec3d& p, const Vec3d& q) const {
  const std::array<double, 6> wanted = pair_of(p, q);
  const auto at =
      std::lower_bound(between_.begin(), between_.end(), wanted,
                       [](const Ends& x, const auto& points) { return x.points < points; });
  if (at == between_.end() || at->points != wanted ||
      (at + 1 != between_.end() && (at + 1)->points == wanted)) {
    return kNoCurve;
  }
  return at->curve;
}

std::uint32_t CreaseCurve::nearest_curve(const Vec3d& p) const {
  ClosestHit hit;
  index_->closest(p, hit);
  return hit.triangle == kNoTriangle ? curve_.front() : curve_[hit.triangle];
}

Vec3d CreaseCurve::closest(const Vec3d& p, std::uint32_t curve) const {
  ClosestHit hit;
  index_->closest_labelled(p, curve, hit);
  return hit.triangle == kNoTriangle
             ? p
             : index_->evaluate(p, static_cast<std::uint32_t>(hit.triangle)).point;
}

CreaseVertices crease_vertices(const PolygonMesh& mesh, const CreaseCurve& creases) {
  const std::size_t n = mesh.vertex_count();
  CreaseVertices out;
  out.neighbors.assign(n, {kNoCurve, kNoCurve});
  out.degree.assign(n, 0);
  out.curve.assign(n, kNoCurve);
  if (creases.empty()) {
    return out;
  }
  for (const auto& edge : mesh.feature_edges) {
    for (std::size_t k = 0; k < 2; ++k) {
      const std::uint32_t v = edge[k];
      if (out.degree[v] < 2) {
        out.neighbors[v][out.degree[v]] = edge[1 - k];
      }
      out.degree[v] += out.degree[v] < 255 ? 1 : 0;
    }
  }
  const auto inside = [&](std::uint32_t v) {
    const std::uint8_t flags = mesh.vertex_flags.empty() ? std::uint8_t{0} : mesh.vertex_flags[v];
    return out.degree[v] == 2 && (flags & (kCornerVertex | kBoundaryVertex)) == 0;
  };
  std::vector<std::uint32_t> chain;
  std::vector<std::uint32_t> votes;
  for (std::uint32_t v = 0; v < n; ++v) {
    if (!inside(v) || out.curve[v] != kNoCurve) {
      continue;
    }
    chain.assign(1, v);
    votes.assign(1, creases.nearest_curve(mesh.positions[v]));
    out.curve[v] = votes.front();  // marks the chain; set below
    std::array<std::uint32_t, 2> ends{v, v};
    for (std::size_t side = 0; side < 2; ++side) {
      std::uint32_t from = v;
      std::uint32_t at = out.neighbors[v][side];
      for (;;) {
        const Vec3d middle = 0.5 * (mesh.positions[from] + mesh.positions[at]);
        votes.push_back(creases.nearest_curve(middle));
        if (!inside(at) || out.curve[at] != kNoCurve) {
          ends[side] = at;
          break;
        }
        chain.push_back(at);
        votes.push_back(creases.nearest_curve(mesh.positions[at]));
        out.curve[at] = votes.back();
        const std::uint32_t next = out.neighbors[at][out.neighbors[at][0] == from ? 1 : 0];
        from = at;
        at = next;
      }
    }
    std::sort(votes.begin(), votes.end());
    std::uint32_t best = votes.front();
    std::size_t most = 0;
    for (std::size_t i = 0; i < votes.size();) {
      std::size_t j = i;
      while (j < votes.size() && votes[j] == votes[i]) {
        ++j;
      }
      if (j - i > most) {
        most = j - i;
        best = votes[i];
      }
      i = j;
    }
    const std::uint32_t known = creases.between(mesh.positions[ends[0]], mesh.positions[ends[1]]);
    best = known != kNoCurve ? known : best;
    for (const std::uint32_t c : chain) {
      out.curve[c] = best;
    }
  }
  return out;
}

}  // namespace rattan
