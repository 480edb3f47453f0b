// SPDX-License-Identifier: MIT
// Closest point on a triangle by the Voronoi regions of its corners and sides, after Ericson,
// Real-Time Collision Detection, 2005, section 5.1.5.
#include "engine/remesh/triangle_index.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <embree3/rtcore.h>

#include "engine/core/errors.h"

namespace rattan {

namespace {

// One Embree primitive is a block of this many consecutive triangles: a hierarchy over single
// triangles takes three times the time and memory to build and gains little per query.
constexpr std::uint32_t kBlock = 4;

RTCDevice shared_device() {
  // Never released: scenes may live until the process ends.
  static const RTCDevice device = [] {
    RTCDevice d = rtcNewDevice(nullptr);
    ensure(d != nullptr, "Embree gives a device");
    return d;
  }();
  return device;
}

void release(void* scene) {
  rtcReleaseScene(static_cast<RTCScene>(scene));
}

ClosestOnTriangle on_segment(const Vec3d& p, const Vec3d& a, const Vec3d& b, int ia, int ib) {
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
ClosestOnTriangle on_degenerate(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
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

}  // namespace

ClosestOnTriangle closest_on_triangle(const Vec3d& p, const Vec3d& a, const Vec3d& b,
                                      const Vec3d& c) {
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

struct TriangleIndex::Query {
  const TriangleIndex* index;
  Vec3d point;
  ClosestHit* hit;
  bool by_label;
  std::uint32_t label;
  float largest_coordinate;  ///< of the point and the triangles
};

struct TriangleIndex::Access {
  // Embree culls with its own single-precision arithmetic, which differs between instruction sets,
  // and sees the point rounded: ask for a little more than the bound, so that every triangle within
  // the bound is always visited.
  static float inflated(double distance2, float largest_coordinate) {
    if (!(distance2 < 1e36)) {
      return std::numeric_limits<float>::infinity();
    }
    const double slack = 2e-6 * static_cast<double>(largest_coordinate);
    return static_cast<float>(std::sqrt(distance2) * (1.0 + 1e-5) + slack + 1e-36);
  }

  static void bounds(const RTCBoundsFunctionArguments* args) {
    const auto* index = static_cast<const TriangleIndex*>(args->geometryUserPtr);
    const std::size_t first = std::size_t{args->primID} * kBlock;
    const std::size_t last = std::min(first + kBlock, index->triangles_.size());
    Vec3f lo = Vec3f::Constant(std::numeric_limits<float>::infinity());
    Vec3f hi = -lo;
    for (std::size_t t = first; t < last; ++t) {
      for (const std::uint32_t v : index->triangles_[t]) {
        lo = lo.cwiseMin(index->positions_[v]);
        hi = hi.cwiseMax(index->positions_[v]);
      }
    }
    *args->bounds_o = {lo.x(), lo.y(), lo.z(), 0.0F, hi.x(), hi.y(), hi.z(), 0.0F};
  }

  static bool visit(RTCPointQueryFunctionArguments* args) {
    auto& query = *static_cast<Query*>(args->userPtr);
    const TriangleIndex& index = *query.index;
    const std::size_t first = std::size_t{args->primID} * kBlock;
    const std::size_t last = std::min(first + kBlock, index.triangles_.size());
    const double before = query.hit->distance2;
    for (std::size_t t = first; t < last; ++t) {
      if (query.by_label && index.labels_[t] != query.label) {
        continue;
      }
      index.try_triangle(query.point, static_cast<std::uint32_t>(t), *query.hit);
    }
    if (query.hit->distance2 < before) {
      args->query->radius =
          std::min(args->query->radius, inflated(query.hit->distance2, query.largest_coordinate));
      return true;
    }
    return false;
  }
};

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
  const RTCDevice device = shared_device();
  const RTCScene scene = rtcNewScene(device);
  rtcSetSceneFlags(scene,
                   static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_COMPACT));
  rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(
      geometry, static_cast<unsigned>((triangles_.size() + kBlock - 1) / kBlock));
  rtcSetGeometryUserData(geometry, this);
  rtcSetGeometryBoundsFunction(geometry, &Access::bounds, nullptr);
  rtcSetGeometryPointQueryFunction(geometry, &Access::visit);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);
  scene_ = scene;
  if (rtcGetDeviceError(device) != RTC_ERROR_NONE) {
    release(scene_);
    scene_ = nullptr;
    throw ResourceError("Embree ran out of memory while it indexed " +
                        std::to_string(triangles_.size()) +
                        " triangles. Give Rattan a larger memory budget.");
  }
}

TriangleIndex::~TriangleIndex() {
  if (scene_ != nullptr) {
    release(scene_);
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
  const double d2 = evaluate(p, local).distance2;
  if (hit.better(d2, base_ + local)) {
    hit.distance2 = d2;
    hit.triangle = base_ + local;
  }
}

void TriangleIndex::search(Query& query) const {
  if (scene_ == nullptr) {
    return;
  }
  RTCPointQuery q;
  q.x = static_cast<float>(query.point.x());
  q.y = static_cast<float>(query.point.y());
  q.z = static_cast<float>(query.point.z());
  q.time = 0.0F;
  query.largest_coordinate =
      std::max(static_cast<float>(query.point.cwiseAbs().maxCoeff()), largest_coordinate_);
  q.radius = Access::inflated(query.hit->distance2, query.largest_coordinate);
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(static_cast<RTCScene>(scene_), &q, &context, nullptr, &query);
}

void TriangleIndex::closest(const Vec3d& p, ClosestHit& hit) const {
  Query query{this, p, &hit, false, 0, 0.0F};
  search(query);
}

void TriangleIndex::closest_labelled(const Vec3d& p, std::uint32_t label, ClosestHit& hit) const {
  Query query{this, p, &hit, true, label, 0.0F};
  search(query);
}

}  // namespace rattan
