// SPDX-License-Identifier: MIT
// Closest point on a triangle by the Voronoi regions of its corners and sides, after Ericson,
// Real-Time Collision Detection, 2005, section 5.1.5.
#include "engine/remesh/triangle_index.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <emmintrin.h>

#include <Eigen/Geometry>

#include "engine/core/errors.h"

namespace rattan {

namespace {

constexpr std::size_t kFan = 8;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

constexpr std::uint32_t kLevelShift = 28;
constexpr std::uint32_t kPlaceMask = (1U << kLevelShift) - 1;

/// A node still to be looked at: its level in the upper bits, its place within the level below.
struct Pending {
  float distance2;
  std::uint32_t node;
};

/// The bound in single precision, widened by more than the rounding of the point and of the boxes'
/// distances (a few units in the last place of the largest coordinate).
float widened(double distance2, float largest_coordinate) {
  const double slack = 1e-6 * static_cast<double>(largest_coordinate);
  const double radius = std::sqrt(distance2) * (1.0 + 1e-5) + slack;
  return static_cast<float>(std::min(radius * radius + 1e-36, 3e38));
}

[[gnu::always_inline]] inline ClosestOnTriangle on_segment(const Vec3d& p, const Vec3d& a,
                                                           const Vec3d& b, int ia, int ib) {
  const Vec3d ab = b - a;
  const double length2 = ab.squaredNorm();
  double t = length2 > 0.0 ? (p - a).dot(ab) / length2 : 0.0;
  t = std::clamp(t, 0.0, 1.0);
  ClosestOnTriangle r{a, {0.0, 0.0, 0.0}, 0.0};
  if (t == 1.0) {
    r.point = b;
  } else if (t > 0.0) {
    r.point = a + t * ab;
  }
  r.weights[static_cast<std::size_t>(ia)] = 1.0 - t;
  r.weights[static_cast<std::size_t>(ib)] += t;
  r.distance2 = (p - r.point).squaredNorm();
  return r;
}

/// No area: the closest of the three sides.
[[gnu::noinline]] ClosestOnTriangle on_degenerate(const Vec3d& p, const Vec3d& a, const Vec3d& b,
                                                  const Vec3d& c) {
  ClosestOnTriangle best = on_segment(p, a, b, 0, 1);
  const ClosestOnTriangle bc = on_segment(p, b, c, 1, 2);
  if (bc.distance2 < best.distance2) {
    best = bc;
  }
  const ClosestOnTriangle ca = on_segment(p, c, a, 2, 0);
  if (ca.distance2 < best.distance2) {
    best = ca;
  }
  return best;
}

/// Part of its callers, so that those who want the distance alone compute no more.
[[gnu::always_inline]] inline ClosestOnTriangle closest_of(const Vec3d& p, const Vec3d& a,
                                                           const Vec3d& b, const Vec3d& c) {
  const Vec3d ab = b - a;
  const Vec3d ac = c - a;
  const Vec3d ap = p - a;
  // The regions of a needle are nothing but rounding.
  if (!(ab.cross(ac).squaredNorm() > 1e-14 * ab.squaredNorm() * ac.squaredNorm())) {
    return on_degenerate(p, a, b, c);
  }
  const double d1 = ab.dot(ap);
  const double d2 = ac.dot(ap);
  if (d1 <= 0.0 && d2 <= 0.0) {
    return {a, {1.0, 0.0, 0.0}, ap.squaredNorm()};
  }
  const Vec3d bp = p - b;
  const double d3 = ab.dot(bp);
  const double d4 = ac.dot(bp);
  if (d3 >= 0.0 && d4 <= d3) {
    return {b, {0.0, 1.0, 0.0}, bp.squaredNorm()};
  }
  const Vec3d cp = p - c;
  const double d5 = ab.dot(cp);
  const double d6 = ac.dot(cp);
  if (d6 >= 0.0 && d5 <= d6) {
    return {c, {0.0, 0.0, 1.0}, cp.squaredNorm()};
  }
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
    return on_segment(p, a, b, 0, 1);
  }
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
    return on_segment(p, a, c, 0, 2);
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    return on_segment(p, b, c, 1, 2);
  }
  const double sum = va + vb + vc;
  if (!(sum > 0.0)) {
    return on_degenerate(p, a, b, c);
  }
  const double v = vb / sum;
  const double w = vc / sum;
  ClosestOnTriangle r{a + ab * v + ac * w, {1.0 - v - w, v, w}, 0.0};
  r.distance2 = (p - r.point).squaredNorm();
  return r;
}

}  // namespace

ClosestOnTriangle closest_on_triangle(const Vec3d& p, const Vec3d& a, const Vec3d& b,
                                      const Vec3d& c) {
  return closest_of(p, a, b, c);
}

TriangleIndex::TriangleIndex(std::span<const Vec3f> positions,
                             std::span<const LocalTriangle> triangles, std::uint64_t base,
                             std::span<const std::uint32_t> labels)
    : positions_(positions), triangles_(triangles), labels_(labels), base_(base) {
  box_min_ = Vec3f::Constant(std::numeric_limits<float>::infinity());
  box_max_ = -box_min_;
  for (const LocalTriangle& t : triangles_) {
    for (const std::uint32_t v : t) {
      box_min_ = box_min_.cwiseMin(positions_[v]);
      box_max_ = box_max_.cwiseMax(positions_[v]);
    }
  }
  if (triangles_.empty()) {
    return;
  }
  largest_coordinate_ = std::max(box_min_.cwiseAbs().maxCoeff(), box_max_.cwiseAbs().maxCoeff());
  const auto empty = [] {
    Node n;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      n.lo[axis].fill(kInfinity);
      n.hi[axis].fill(-kInfinity);
    }
    return n;
  };
  std::size_t total = 0;
  for (std::size_t n = (triangles_.size() + kFan - 1) / kFan;; n = (n + kFan - 1) / kFan) {
    level_begin_.push_back(static_cast<std::uint32_t>(total));
    total += n;
    if (n == 1) {
      break;
    }
  }
  level_begin_.push_back(static_cast<std::uint32_t>(total));
  nodes_.assign(total, empty());
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    const LocalTriangle& c = triangles_[t];
    const Vec3f lo = positions_[c[0]].cwiseMin(positions_[c[1]]).cwiseMin(positions_[c[2]]);
    const Vec3f hi = positions_[c[0]].cwiseMax(positions_[c[1]]).cwiseMax(positions_[c[2]]);
    Node& node = nodes_[t / kFan];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      node.lo[axis][t % kFan] = lo[static_cast<Eigen::Index>(axis)];
      node.hi[axis][t % kFan] = hi[static_cast<Eigen::Index>(axis)];
    }
  }
  for (std::size_t level = 1; level + 1 < level_begin_.size(); ++level) {
    const std::uint32_t below = level_begin_[level - 1];
    for (std::uint32_t child = below; child < level_begin_[level]; ++child) {
      Node& node = nodes_[level_begin_[level] + (child - below) / kFan];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto& lo = nodes_[child].lo[axis];
        const auto& hi = nodes_[child].hi[axis];
        node.lo[axis][(child - below) % kFan] = *std::min_element(lo.begin(), lo.end());
        node.hi[axis][(child - below) % kFan] = *std::max_element(hi.begin(), hi.end());
      }
    }
  }
}

ClosestOnTriangle TriangleIndex::evaluate(const Vec3d& p, std::uint32_t local) const {
  const LocalTriangle& t = triangles_[local];
  return closest_on_triangle(p, positions_[t[0]].cast<double>(), positions_[t[1]].cast<double>(),
                             positions_[t[2]].cast<double>());
}

Vec3d TriangleIndex::normal(std::uint32_t local) const {
  const LocalTriangle& t = triangles_[local];
  const Vec3d a = positions_[t[0]].cast<double>();
  const Vec3d n = (positions_[t[1]].cast<double>() - a).cross(positions_[t[2]].cast<double>() - a);
  const double length = n.norm();
  return length > 0.0 ? Vec3d(n / length) : Vec3d::Zero();
}

void TriangleIndex::try_triangle(const Vec3d& p, std::uint32_t local, ClosestHit& hit) const {
  const LocalTriangle& t = triangles_[local];
  const double d2 = closest_of(p, positions_[t[0]].cast<double>(), positions_[t[1]].cast<double>(),
                               positions_[t[2]].cast<double>())
                        .distance2;
  if (hit.better(d2, base_ + local)) {
    hit.distance2 = d2;
    hit.triangle = base_ + local;
  }
}

template <class Accept>
void TriangleIndex::search(const Vec3d& p, const Accept& accept, ClosestHit& hit) const {
  if (nodes_.empty()) {
    return;
  }
  const Vec3f q = p.cast<float>();
  const float largest = std::max(q.cwiseAbs().maxCoeff(), largest_coordinate_);
  float bound = widened(hit.distance2, largest);
  // Depth first, the nearest child first. Ten levels of seven waiting siblings are 2^28 nodes.
  std::array<Pending, 80> stack;
  std::size_t waiting = 0;
  stack[waiting++] = {0.0F, static_cast<std::uint32_t>(level_begin_.size() - 2) << kLevelShift};
  const __m128 zero = _mm_setzero_ps();
  const __m128 at[3] = {_mm_set1_ps(q.x()), _mm_set1_ps(q.y()), _mm_set1_ps(q.z())};
  while (waiting > 0) {
    const Pending top = stack[--waiting];
    if (top.distance2 > bound) {
      continue;
    }
    const std::uint32_t level = top.node >> kLevelShift;
    const std::uint32_t place = top.node & kPlaceMask;
    const Node& node = nodes_[level_begin_[level] + place];
    alignas(16) std::array<float, kFan> distance2;
    unsigned near = 0;
    for (std::size_t half = 0; half < kFan; half += 4) {
      __m128 sum = zero;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const __m128 below = _mm_sub_ps(_mm_loadu_ps(&node.lo[axis][half]), at[axis]);
        const __m128 above = _mm_sub_ps(at[axis], _mm_loadu_ps(&node.hi[axis][half]));
        const __m128 out = _mm_max_ps(_mm_max_ps(below, above), zero);
        sum = _mm_add_ps(sum, _mm_mul_ps(out, out));
      }
      _mm_store_ps(&distance2[half], sum);
      near |= static_cast<unsigned>(_mm_movemask_ps(_mm_cmple_ps(sum, _mm_set1_ps(bound)))) << half;
    }
    const std::uint32_t first = place * static_cast<std::uint32_t>(kFan);
    if (level > 0) {
      const std::uint32_t children = (level - 1) << kLevelShift | first;
      const std::size_t begin = waiting;
      std::size_t nearest = waiting;
      for (; near != 0; near &= near - 1) {
        const auto c = static_cast<std::uint32_t>(std::countr_zero(near));
        stack[waiting] = {distance2[c], children + c};
        nearest = distance2[c] < stack[nearest].distance2 ? waiting : nearest;
        ++waiting;
      }
      if (waiting > begin) {
        std::swap(stack[nearest], stack[waiting - 1]);
      }
      continue;
    }
    const auto look = [&](std::uint32_t c) {
      if (distance2[c] <= bound && accept(first + c)) {
        const double before = hit.distance2;
        try_triangle(p, first + c, hit);
        if (hit.distance2 < before) {
          bound = widened(hit.distance2, largest);
        }
      }
    };
    if (near == 0) {
      continue;
    }
    auto nearest = static_cast<std::uint32_t>(std::countr_zero(near));
    for (unsigned others = near & (near - 1); others != 0; others &= others - 1) {
      const auto c = static_cast<std::uint32_t>(std::countr_zero(others));
      nearest = distance2[c] < distance2[nearest] ? c : nearest;
    }
    look(nearest);
    for (near &= ~(1U << nearest); near != 0; near &= near - 1) {
      look(static_cast<std::uint32_t>(std::countr_zero(near)));
    }
  }
}

void TriangleIndex::closest(const Vec3d& p, ClosestHit& hit) const {
  search(
      p, [](std::uint32_t) { return true; }, hit);
}

void TriangleIndex::closest_labelled(const Vec3d& p, std::uint32_t label, ClosestHit& hit) const {
  search(
      p, [&](std::uint32_t t) { return labels_[t] == label; }, hit);
}

}  // namespace rattan
