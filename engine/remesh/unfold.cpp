// SPDX-License-Identifier: MIT
//
// Beside sharp edges a vertex has no normal to hold faces to, so what is folded shows between faces
// only.
#include "engine/remesh/unfold.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "engine/remesh/cell_map.h"
#include "engine/remesh/repair.h"

namespace rattan {

namespace {

constexpr int kRounds = 4;
/// Cosine between the normals of two faces below which a fold costs, inside and at a sharp edge,
/// and how much more corners count that are folded within a quad.
constexpr double kFlatter = 0.5;
constexpr double kFoldedCrease = -0.6;
constexpr double kCorner = 2.0;
constexpr double kLeastCorner = 0.3;
/// A change has to gain this much.
constexpr double kGain = 0.05;

class Unfolder {
 public:
  explicit Unfolder(CellMap& map) : map_(map) {}

  std::uint64_t run() {
    std::uint64_t replaced = 0;
    for (int round = 0; round < kRounds; ++round) {
      std::uint64_t now = 0;
      const std::uint32_t halves = map_.half_count();
      std::vector<std::uint8_t> folded(map_.face_count(), 0);
      for (std::uint32_t h = 0; h < halves; h += 2) {
        if (map_.half_alive(h) && is_folded(h)) {
          folded[map_.face(h)] = folded[map_.face(CellMap::twin(h))] = 1;
        }
      }
      for (std::uint32_t h = 0; h < halves; h += 2) {
        if (map_.half_alive(h) && can_go(h) &&
            (folded[map_.face(h)] != 0 || folded[map_.face(CellMap::twin(h))] != 0) && replace(h)) {
          ++now;
        }
      }
      replaced += now;
      if (now == 0) {
        break;
      }
    }
    return replaced;
  }

 private:
  using Corners = std::array<Vec3d, 4>;

  static Vec3d area(const Vec3d* p, std::size_t n) {
    Vec3d sum = (p[1] - p[0]).cross(p[2] - p[0]);
    if (n == 4) {
      sum += (p[2] - p[0]).cross(p[3] - p[0]);
    }
    return sum;
  }
  static Vec3d unit(const Vec3d& v) {
    const double length = v.norm();
    return length > 0.0 ? Vec3d(v / length) : Vec3d(Vec3d::Zero());
  }
  /// The worst corner of a face against its own normal; thin triangles count too.
  static double corner_cost(const Vec3d* p, std::size_t n, const Vec3d& normal) {
    double least = 1.0;
    for (std::size_t k = 0; k < n; ++k) {
      const Vec3d a = p[(k + 1) % n] - p[k];
      const Vec3d b = p[(k + n - 1) % n] - p[k];
      const double lengths = std::sqrt(a.squaredNorm() * b.squaredNorm());
      least = std::min(least, lengths > 0.0 ? a.cross(b).dot(normal) / lengths : 0.0);
    }
    return kCorner * std::max(0.0, kLeastCorner - least);
  }

  bool is_inside(std::uint32_t h) const {
    const std::uint32_t f = map_.face(h);
    const std::uint32_t g = map_.face(CellMap::twin(h));
    return f != g && !map_.is_hole(f) && !map_.is_hole(g);
  }
  bool can_go(std::uint32_t h) const { return is_inside(h) && !map_.is_feature(h); }
  bool is_folded(std::uint32_t h) const {
    return is_inside(h) && unit(map_.face_normal(map_.face(h)))
                                   .dot(unit(map_.face_normal(map_.face(CellMap::twin(h))))) <
                               (map_.is_feature(h) ? kFoldedCrease : 0.0);
  }

  /// Folds of a part with what is beside it, and its own corners. `from` and `to`: its corners in
  /// ring_, the side from `to` back to `from` being the diagonal.
  double part_cost(std::size_t from, std::size_t to, Vec3d& normal) const {
    const std::size_t n = ring_.size();
    Corners p;
    std::size_t count = 0;
    for (std::size_t i = from;; i = (i + 1) % n) {
      p[count++] = map_.position(map_.origin(ring_[i]));
      if (i == to) {
        break;
      }
    }
    normal = unit(area(p.data(), count));
    double cost = corner_cost(p.data(), count, normal);
    for (std::size_t i = from; i != to; i = (i + 1) % n) {
      const std::uint32_t beside = map_.face(CellMap::twin(ring_[i]));
      if (!map_.is_hole(beside)) {
        const double cosine = normal.dot(unit(map_.face_normal(beside)));
        cost += std::max(0.0, (map_.is_feature(ring_[i]) ? kFoldedCrease : kFlatter) - cosine);
      }
    }
    return cost;
  }

  double cost(std::size_t i, std::size_t j) const {
    Vec3d n;
    Vec3d m;
    const double sum = part_cost(i, j, n) + part_cost(j, i, m);
    return sum + 2.0 * std::max(0.0, kFlatter - n.dot(m));
  }

  bool replace(std::uint32_t h) {
    const std::uint32_t u = map_.origin(h);
    const std::uint32_t v = map_.target(h);
    for (const std::uint32_t w : {u, v}) {
      if (map_.valence(w) <= (map_.on_boundary(w) ? 2U : 3U)) {
        return false;
      }
    }
    // Around both faces, from v by way of h's face.
    ring_.clear();
    for (const std::uint32_t start : {h, CellMap::twin(h)}) {
      for (std::uint32_t at = map_.next(start); at != start; at = map_.next(at)) {
        ring_.push_back(at);
      }
    }
    const std::size_t n = ring_.size();
    const std::size_t here = map_.degree(map_.face(h)) - 1;  // of u
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i + 1; j < n; ++j) {
        if (map_.origin(ring_[i]) == map_.origin(ring_[j])) {
          return false;
        }
      }
    }
    double best = cost(0, here) - kGain;
    std::pair<std::size_t, std::size_t> choice{n, n};
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i + 2; j < std::min(n, i + 4); ++j) {
        const bool parts_fit = n - (j - i) >= 2 && n - (j - i) <= 3;
        if (!parts_fit || (i == 0 && j == here) ||
            map_.adjacent(map_.origin(ring_[i]), map_.origin(ring_[j]))) {
          continue;
        }
        const double c = cost(i, j);
        if (c < best) {
          best = c;
          choice = {i, j};
        }
      }
    }
    if (choice.first == n) {
      return false;
    }
    const std::uint32_t from = ring_[choice.first];
    const std::uint32_t to = ring_[choice.second];
    map_.erase_edge(h);
    map_.split_face(from, to);
    return true;
  }

  CellMap& map_;
  std::vector<std::uint32_t> ring_;
};

}  // namespace

std::uint64_t unfold_faces(PolygonMesh& mesh) {
  CellMap map(std::move(mesh));
  const std::uint64_t replaced = Unfolder(map).run();
  if (replaced > 0) {
    map.set_normals({});
    repair(map);
  }
  mesh = map.to_mesh();
  return replaced;
}

}  // namespace rattan
