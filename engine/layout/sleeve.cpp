// SPDX-License-Identifier: MIT
//
// Based on: Lee and Preparata, Euclidean shortest paths in the presence of rectilinear barriers
// (1984): the funnel in a strip of triangles; and on passing vertices on their other side as long
// as that shortens the path (Xin and Wang, Efficiently determining a locally exact shortest path on
// polyhedral surfaces, 2007). Ours: edges are narrowed to gates that keep off walls, and a flip is
// judged by the path that comes of it rather than by angles, which needles make worthless.
#include "engine/layout/sleeve.h"

#include <algorithm>
#include <cmath>

namespace rattan::layout {

namespace {

/// Of an edge: how far paths keep off a wall at its end, and off walls at both. Bundles of paths
/// around one corner get narrower by this factor with each.
constexpr double kClear = 0.2;
constexpr double kClearBetween = 0.25;

double cross(const Vec2d& a, const Vec2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// Where c lies if a and b are laid down at pa and pb and c to the right of the way between.
Vec2d lay_right(const Vec2d& pa, const Vec2d& pb, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const Vec3d edge = b - a;
  const double length = edge.norm();
  if (!(length > 0)) {
    return pa + Vec2d(0, -(c - a).norm());
  }
  const double along = (c - a).dot(edge) / length;
  const double beside = edge.cross(c - a).norm() / length;
  const Vec2d direction = (pb - pa) / length;
  return pa + along * direction + beside * Vec2d(direction.y(), -direction.x());
}

}  // namespace

SleevePaths::SleevePaths(const CutMesh& mesh, VertexHandle from, VertexHandle to)
    : mesh_(&mesh), from_(from), to_(to), place_(mesh.n_faces(), -1) {}

void SleevePaths::tidy(Sleeve& s) {
  s.gate.clear();
  if (s.crossed.empty()) {
    return;
  }
  const bool shares = !s.share.empty();
  const auto after = [&](std::size_t i) {
    return mesh_->face_handle(mesh_->opposite(s.crossed[i])).idx();
  };
  const FaceHandle first = mesh_->face_handle(s.crossed[0]);
  place_[first.idx()] = 0;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < s.crossed.size(); ++i) {
    const int face = after(i);
    if (place_[face] >= 0) {  // been there: what lies between is a loop
      const auto back = static_cast<std::size_t>(place_[face]);
      for (std::size_t k = back; k < kept; ++k) {
        place_[after(k)] = -1;
      }
      kept = back;
      continue;
    }
    s.crossed[kept] = s.crossed[i];
    if (shares) {
      s.share[kept] = s.share[i];
    }
    place_[face] = static_cast<int>(++kept);
  }
  place_[first.idx()] = -1;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < kept; ++i) {
    place_[after(i)] = -1;
    if (mesh_->contains(FaceHandle(after(i)), from_)) {
      begin = i + 1;
    }
  }
  std::size_t end = begin;
  const auto face = [&](std::size_t i) { return i == 0 ? first : FaceHandle(after(i - 1)); };
  while (end < kept && !mesh_->contains(face(end), to_)) {
    ++end;
  }
  const auto cut = [&](auto& list) {
    list.resize(end);
    list.erase(list.begin(), list.begin() + static_cast<std::ptrdiff_t>(begin));
  };
  cut(s.crossed);
  if (shares) {
    cut(s.share);
  }
}

void SleevePaths::open_gates(Sleeve& s) const {
  s.gate.resize(s.crossed.size());
  for (std::size_t i = 0; i < s.crossed.size(); ++i) {
    const bool from = mesh_->is_wall(mesh_->from_vertex_handle(s.crossed[i]));
    const bool to = mesh_->is_wall(mesh_->to_vertex_handle(s.crossed[i]));
    const double clear = from && to ? kClearBetween : kClear;
    s.gate[i] = {from ? clear : 0.0, to ? 1.0 - clear : 1.0};
  }
}

void SleevePaths::unfold(const Sleeve& s) {
  const CutMesh& m = *mesh_;
  const std::size_t n = s.crossed.size();
  ends_.resize(n);
  gates_.resize(n + 1);
  HalfedgeHandle h = s.crossed[0];
  ends_[0] = {Vec2d(0, 0), Vec2d(m.length(m.edge_handle(h)), 0)};
  start_ = lay_right(ends_[0][1], ends_[0][0], m.position(m.to_vertex_handle(h)),
                     m.position(m.from_vertex_handle(h)), m.position(from_));
  for (std::size_t i = 0; i < n; ++i) {
    h = s.crossed[i];
    const Vec2d& right = ends_[i][0];
    const Vec2d& left = ends_[i][1];
    const HalfedgeHandle back = m.opposite(h);
    const HalfedgeHandle right_side = m.next(back);
    const Vec2d apex =
        lay_right(right, left, m.position(m.from_vertex_handle(h)),
                  m.position(m.to_vertex_handle(h)), m.position(m.to_vertex_handle(right_side)));
    if (i + 1 == n) {
      end_ = apex;
    } else if (s.crossed[i + 1] == right_side) {
      ends_[i + 1] = {right, apex};
    } else {
      ends_[i + 1] = {apex, left};
    }
    // Exact at the ends: the funnel compares points.
    const auto at = [&](double t) -> Vec2d {
      return t == 0 ? right : t == 1 ? left : Vec2d(right + t * (left - right));
    };
    gates_[i] = {at(s.gate[i][0]), at(s.gate[i][1])};
  }
  gates_[n] = {end_, end_};
}

void SleevePaths::funnel(const Sleeve& s) {
  const auto n = static_cast<std::ptrdiff_t>(s.crossed.size());
  corners_.clear();
  Vec2d apex = start_;
  std::array<Vec2d, 2> tip{start_, start_};  // right and left wall of the funnel
  std::array<std::ptrdiff_t, 2> tip_gate{-1, -1};
  std::ptrdiff_t apex_gate = -1;
  for (std::ptrdiff_t i = 0; i <= n; ++i) {
    const std::array<Vec2d, 2>& gate = gates_[static_cast<std::size_t>(i)];
    const auto restart = [&](std::ptrdiff_t at) {
      apex_gate = at;
      tip = {apex, apex};
      tip_gate = {at, at};
    };
    if (gate[0] == apex || gate[1] == apex) {  // nothing is gained by leaving before
      restart(i);
      continue;
    }
    for (int side = 0; side < 2; ++side) {
      const double turn = side == 0 ? 1.0 : -1.0;
      const Vec2d to = gate[static_cast<std::size_t>(side)] - apex;
      auto& mine = tip[static_cast<std::size_t>(side)];
      const auto other = static_cast<std::size_t>(1 - side);
      if (turn * cross(mine - apex, to) < 0) {
        continue;  // wider than the funnel
      }
      if (mine == apex || turn * cross(tip[other] - apex, to) < 0 || tip_gate[other] <= apex_gate) {
        mine = gate[static_cast<std::size_t>(side)];
        tip_gate[static_cast<std::size_t>(side)] = i;
        continue;
      }
      if (tip_gate[other] == n) {
        return;  // both walls have come to the end
      }
      // It runs across the other wall: the path bends there.
      corners_.push_back({static_cast<std::size_t>(tip_gate[other]), tip[other], 1 - side});
      apex = tip[other];
      i = tip_gate[other];
      restart(i);
      break;
    }
  }
}

void SleevePaths::pull(Sleeve& s) {
  const std::size_t n = s.crossed.size();
  s.share.assign(n, 0.5);
  s.bend.clear();
  if (n > 0) {
    unfold(s);
    funnel(s);
    Vec2d a = start_;
    std::size_t i = 0;
    for (std::size_t c = 0; c <= corners_.size(); ++c) {
      const bool last = c == corners_.size();
      const Vec2d b = last ? end_ : corners_[c].point;
      const std::size_t end = last ? n : corners_[c].gate;
      for (; i < end; ++i) {
        const Vec2d d = ends_[i][1] - ends_[i][0];
        const Vec2d from = a - ends_[i][0];
        double t = cross(from, b - a) / cross(d, b - a);
        if (!std::isfinite(t)) {
          t = from.dot(d) / d.squaredNorm();
        }
        s.share[i] = std::isfinite(t) ? std::clamp(t, s.gate[i][0], s.gate[i][1]) : s.gate[i][0];
      }
      if (!last) {
        const double t = s.gate[end][static_cast<std::size_t>(corners_[c].end)];
        s.share[end] = t;
        if ((t == 0 || t == 1) && s.gate[end][0] != s.gate[end][1]) {
          s.bend.push_back(end);
        }
        i = end + 1;
        a = b;
      }
    }
  }
  measure(s);
}

void SleevePaths::measure(Sleeve& s) const {
  Vec3d at = mesh_->position(from_);
  s.length = 0;
  for (std::size_t i = 0; i < s.crossed.size(); ++i) {
    const Vec3d next = mesh_->point(s.crossed[i], s.share[i]);
    s.length += (next - at).norm();
    at = next;
  }
  s.length += (mesh_->position(to_) - at).norm();
}

bool SleevePaths::flip(const Sleeve& s, std::size_t bend, Sleeve& flipped) {
  const CutMesh& m = *mesh_;
  const HalfedgeHandle h = s.crossed[bend];
  const VertexHandle v = s.share[bend] == 0 ? m.from_vertex_handle(h) : m.to_vertex_handle(h);
  if (m.is_wall(v)) {
    return false;
  }
  const auto meets = [&](std::size_t i) {
    return m.from_vertex_handle(s.crossed[i]) == v || m.to_vertex_handle(s.crossed[i]) == v;
  };
  std::size_t begin = bend;
  std::size_t end = bend + 1;
  while (begin > 0 && meets(begin - 1)) {
    --begin;
  }
  while (end < s.crossed.size() && meets(end)) {
    ++end;
  }
  flipped.crossed.assign(s.crossed.begin(), s.crossed.begin() + static_cast<std::ptrdiff_t>(begin));
  flipped.share.clear();
  // No vertex but a wall is on the rim, so there are triangles all around.
  const FaceHandle goal = m.face_handle(m.opposite(s.crossed[end - 1]));
  const bool clockwise = m.to_vertex_handle(s.crossed[begin]) == v;
  HalfedgeHandle ray = s.crossed[begin];
  do {
    ray = clockwise ? m.next(ray) : m.next(m.next(ray));
    flipped.crossed.push_back(ray);
    ray = m.opposite(ray);
  } while (m.face_handle(ray) != goal);
  flipped.crossed.insert(flipped.crossed.end(),
                         s.crossed.begin() + static_cast<std::ptrdiff_t>(end), s.crossed.end());
  tidy(flipped);
  open_gates(flipped);
  return true;
}

}  // namespace rattan::layout
