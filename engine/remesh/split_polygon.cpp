// SPDX-License-Identifier: MIT
#include "engine/remesh/split_polygon.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include "engine/core/errors.h"
#include "engine/core/exact_math.h"

namespace rattan {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kReflex = 2.0;
// Such a quad comes to be divided into two triangles.
constexpr double kFirm = 3.0;
constexpr double kFirmSine = 0.6;
constexpr double kNormal = 1.0;
constexpr double kFlipped = 3.0;
/// An additional face and, but for octagons, an irregular vertex.
constexpr double kStar = 0.6;
constexpr std::uint8_t kNoCorner = 255;

double square(double x) {
  return x * x;
}

double angle_cost(double angle, double ideal) {
  return 0.5 * square(angle - ideal) + (angle > exact::kPi ? kReflex : 0.0);
}

double normal_cost(const Vec3d& area, const Vec3d& surface) {
  const double size = area.norm() * surface.norm();
  const double cosine = size > 0 ? area.dot(surface) / size : 0.0;
  return kNormal * (1 - cosine) + (cosine < 0 ? kFlipped : 0.0);
}

}  // namespace

void PolygonSplitter::prepare(const PolygonCorners& polygon) {
  polygon_ = &polygon;
  n_ = polygon.size();
  ensure(n_ >= 3 && n_ <= kSplitMaxCorners, "a polygon to split has 3 to 40 corners");
  normal_ = Vec3d::Zero();
  for (std::size_t i = 0; i < n_; ++i) {
    normal_ += (polygon.position[i] - polygon.position[0])
                   .cross(polygon.position[(i + 1) % n_] - polygon.position[0]);
  }
  const double area = normal_.norm();
  if (area > 0) {
    normal_ /= area;
  }
  normals_.assign(polygon.normal.begin(), polygon.normal.end());
  // Directions in each corner's tangent plane, so that every angle is a difference of two numbers.
  bearing_.assign(n_ * n_, 0.0);
  length_.assign(n_ * n_, 0.0);
  for (std::size_t i = 0; i < n_; ++i) {
    if (normals_[i].squaredNorm() == 0) {
      normals_[i] = normal_;
    }
    const Vec3d& normal = normals_[i];
    Vec3d x = polygon.position[(i + 1) % n_] - polygon.position[i];
    x -= normal * normal.dot(x);
    const double size = x.norm();
    if (size > 0) {
      x /= size;
    } else {
      x = normal.cross(std::abs(normal.x()) < 0.6 ? Vec3d::UnitX() : Vec3d::UnitY()).normalized();
    }
    const Vec3d y = normal.cross(x);
    for (std::size_t j = 0; j < n_; ++j) {
      if (j != i) {
        const Vec3d d = polygon.position[j] - polygon.position[i];
        bearing_[i * n_ + j] = exact::atan2(y.dot(d), x.dot(d));
        length_[i * n_ + j] = d.norm();
      }
    }
  }
}

double PolygonSplitter::corner_angle(std::size_t at, std::size_t before, std::size_t after) const {
  const double angle = bearing_[at * n_ + before] - bearing_[at * n_ + after];
  return angle < 0 ? angle + 2 * exact::kPi : angle;
}

double PolygonSplitter::quad_angle_cost(std::size_t at, double angle) const {
  const bool firm = !polygon_->firm.empty() && polygon_->firm[at] != 0;
  const double cost = angle_cost(angle, exact::kPi / 2);
  return firm && exact::sincos(angle).sin < kFirmSine ? cost + kFirm : cost;
}

double PolygonSplitter::triangle_cost(std::size_t i, std::size_t k, std::size_t j) const {
  const auto& id = polygon_->vertex;
  if (id[i] == id[k] || id[k] == id[j] || id[i] == id[j]) {
    return kInfinity;
  }
  const auto& p = polygon_->position;
  constexpr double kIdeal = exact::kPi / 3;
  return kTriangle + angle_cost(corner_angle(i, j, k), kIdeal) +
         angle_cost(corner_angle(k, i, j), kIdeal) + angle_cost(corner_angle(j, k, i), kIdeal) +
         normal_cost((p[k] - p[i]).cross(p[j] - p[i]), normals_[i] + normals_[k] + normals_[j]);
}

double PolygonSplitter::quad_cost(std::size_t i, std::size_t k, std::size_t l,
                                  std::size_t j) const {
  const auto& id = polygon_->vertex;
  if (id[i] == id[k] || id[i] == id[l] || id[i] == id[j] || id[k] == id[l] || id[k] == id[j] ||
      id[l] == id[j]) {
    return kInfinity;
  }
  const auto& p = polygon_->position;
  const double angles =
      quad_angle_cost(i, corner_angle(i, j, k)) + quad_angle_cost(k, corner_angle(k, i, l)) +
      quad_angle_cost(l, corner_angle(l, k, j)) + quad_angle_cost(j, corner_angle(j, l, i));
  const double along = length_[i * n_ + k] + length_[l * n_ + j];
  const double across = length_[k * n_ + l] + length_[i * n_ + j];
  const double floor = 1e-6 * (along + across) + 1e-300;
  const double aspect = exact::log((along + floor) / (across + floor));
  return angles + 0.25 * aspect * aspect +
         normal_cost((p[l] - p[i]).cross(p[j] - p[k]),
                     normals_[i] + normals_[k] + normals_[l] + normals_[j]);
}

double PolygonSplitter::star_cost(std::size_t first) const {
  // The centre's own angles count as even; the corners' angles are halved where a spoke ends.
  const auto& p = polygon_->position;
  Vec3d centre = Vec3d::Zero();
  for (const Vec3d& q : p) {
    centre += q;
  }
  centre /= static_cast<double>(n_);
  const std::size_t spokes = n_ / 2;
  const auto quads = static_cast<double>(spokes);
  double cost = kStar + quads * angle_cost(2 * exact::kPi / quads, exact::kPi / 2);
  for (std::size_t i = 0; i < n_; ++i) {
    const std::size_t before = (i + n_ - 1) % n_, after = (i + 1) % n_;
    const double angle = corner_angle(i, before, after);
    const bool spoke = i % 2 == first;
    cost += spoke ? 2 * quad_angle_cost(i, angle / 2) : quad_angle_cost(i, angle);
    if (spoke) {
      const double aspect =
          exact::log(((centre - p[i]).norm() + 1e-300) / (length_[i * n_ + before] + 1e-300));
      cost += 0.25 * aspect * aspect;
    }
  }
  return cost;
}

PolygonSplit PolygonSplitter::split(const PolygonCorners& polygon, bool quads_only, bool stars) {
  prepare(polygon);
  const std::size_t n = n_;
  best_.assign(n * n, kInfinity);
  choice_.assign(n * n, {kNoCorner, kNoCorner});
  for (std::size_t i = 0; i + 1 < n; ++i) {
    best_[i * n + i + 1] = 0;
  }
  for (std::size_t span = 2; span < n; ++span) {
    if (quads_only && span % 2 == 0) {
      continue;
    }
    for (std::size_t i = 0; i + span < n; ++i) {
      const std::size_t j = i + span;
      if (span + 1 < n && polygon.forbidden[i * n + j]) {
        continue;
      }
      double best = kInfinity;
      std::array<std::uint8_t, 2> choice{kNoCorner, kNoCorner};
      for (std::size_t k = i + 1; k < j; ++k) {
        const double left = best_[i * n + k];
        if (left == kInfinity) {
          continue;
        }
        const double right = best_[k * n + j];
        if (!quads_only && left + right + kTriangle < best) {
          const double cost = left + right + triangle_cost(i, k, j);
          if (cost < best) {
            best = cost;
            choice = {static_cast<std::uint8_t>(k), kNoCorner};
          }
        }
        for (std::size_t l = k + 1; l < j; ++l) {
          const double rest = left + best_[k * n + l] + best_[l * n + j];
          if (rest < best) {
            const double cost = rest + quad_cost(i, k, l, j);
            if (cost < best) {
              best = cost;
              choice = {static_cast<std::uint8_t>(k), static_cast<std::uint8_t>(l)};
            }
          }
        }
      }
      if (!polygon.bias.empty() && span + 1 < n) {
        best += polygon.bias[i] + polygon.bias[j];
      }
      best_[i * n + j] = best;
      choice_[i * n + j] = choice;
    }
  }
  PolygonSplit split;
  split.cost = best_[n - 1];
  split.feasible = split.cost < kInfinity;
  if (stars && n % 2 == 0 && n >= 6 && n <= 10) {
    for (std::size_t first = 0; first < 2; ++first) {
      const double cost = star_cost(first);
      if (cost < split.cost) {
        split.cost = cost;
        split.star = static_cast<int>(first);
        split.feasible = true;
      }
    }
    // Quads of a star take a spoke's two neighbours; all corners distinct makes it valid.
    if (split.star >= 0) {
      std::vector<std::uint32_t> ids = polygon.vertex;
      std::sort(ids.begin(), ids.end());
      if (std::adjacent_find(ids.begin(), ids.end()) == ids.end()) {
        return split;
      }
      split.star = -1;
      split.cost = best_[n - 1];
      split.feasible = split.cost < kInfinity;
    }
  }
  if (split.feasible) {
    collect(0, n - 1, split);
    if (!polygon.bias.empty()) {
      for (const auto& [i, j] : split.diagonals) {
        split.cost -= polygon.bias[i] + polygon.bias[j];
      }
    }
  }
  return split;
}

void PolygonSplitter::collect(std::size_t i, std::size_t j, PolygonSplit& split) const {
  if (j - i < 2) {
    return;
  }
  if (j - i + 1 < n_) {
    split.diagonals.emplace_back(i, j);
  }
  const std::array<std::uint8_t, 2> choice = choice_[i * n_ + j];
  collect(i, choice[0], split);
  if (choice[1] == kNoCorner) {
    collect(choice[0], j, split);
  } else {
    collect(choice[0], choice[1], split);
    collect(choice[1], j, split);
  }
}

double PolygonSplitter::cost(const PolygonCorners& polygon) {
  prepare(polygon);
  return n_ == 3 ? triangle_cost(0, 1, 2) : quad_cost(0, 1, 2, 3);
}

}  // namespace rattan
