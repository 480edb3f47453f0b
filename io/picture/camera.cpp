// SPDX-License-Identifier: MIT
#include "io/picture/camera.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include <Eigen/Geometry>

namespace rattan {

Camera::View Camera::default_view(const Vec3d& low, const Vec3d& high, int up_axis) {
  View view;
  view.up_axis = up_axis;
  const Vec3d extent = high - low;
  int thin = 0;
  for (int k = 1; k < 3; ++k) {
    thin = extent[k] < extent[thin] ? k : thin;
  }
  const double second = std::min(extent[(thin + 1) % 3], extent[(thin + 2) % 3]);
  if (extent[thin] < 0.3 * second) {
    view.up_axis = thin;
    view.elevation = 0.95;
  }
  return view;
}

Camera::Camera(const Vec3d& low, const Vec3d& high, const View& view) {
  const Vec3d extent = high - low;
  diagonal_ = std::max(extent.norm(), std::numeric_limits<double>::min() * 1e6);
  const Vec3d up = view.up.isZero(0.0) ? Vec3d(Vec3d::Unit(view.up_axis)) : view.up;
  Vec3d ahead = view.up_axis == 2 ? Vec3d(-Vec3d::Unit(1)) : Vec3d::Unit(view.up_axis + 1);
  ahead = (ahead - up * up.dot(ahead)).normalized();
  const Vec3d side = up.cross(ahead);
  const Vec3d toward_eye =
      std::cos(view.elevation) * (std::cos(view.azimuth) * ahead + std::sin(view.azimuth) * side) +
      std::sin(view.elevation) * up;
  forward_ = -toward_eye.normalized();
  right_ = forward_.cross(up).normalized();
  up_ = right_.cross(forward_);
  eye_ = 0.5 * (low + high) - 2.6 * diagonal_ * forward_;
  start_frame();
}

void Camera::start_frame() {
  low_x_ = low_y_ = std::numeric_limits<float>::infinity();
  high_x_ = high_y_ = -low_x_;
}

void Camera::include(std::span<const Vec3f> points) {
  for (const Vec3f& point : points) {
    const Vec3f p = to_camera(point);
    if (p.z() > 0.0F) {
      low_x_ = std::min(low_x_, p.x() / p.z());
      high_x_ = std::max(high_x_, p.x() / p.z());
      low_y_ = std::min(low_y_, p.y() / p.z());
      high_y_ = std::max(high_y_, p.y() / p.z());
    }
  }
}

void Camera::fit(int width, int height, double margin) {
  const auto w = static_cast<float>(width);
  const auto h = static_cast<float>(height);
  const float border = static_cast<float>(margin) * std::min(w, h);
  const float wide = std::max(high_x_ - low_x_, 1e-6F);
  const float tall = std::max(high_y_ - low_y_, 1e-6F);
  scale_ = std::min((w - 2.0F * border) / wide, (h - 2.0F * border) / tall);
  if (!std::isfinite(scale_)) {
    low_x_ = low_y_ = -1.0F;
    high_x_ = high_y_ = 1.0F;
    scale_ = std::min(w, h) * 0.5F;
  }
  cx_ = 0.5F * w - scale_ * 0.5F * (low_x_ + high_x_);
  cy_ = 0.5F * h + scale_ * 0.5F * (low_y_ + high_y_);
}

void Camera::zoom(const Vec3f& point, float factor, int width, int height) {
  const Vec3f at = project(to_camera(point));
  const auto w = static_cast<float>(width);
  const auto h = static_cast<float>(height);
  const float x = std::clamp(at.x(), 0.5F * w / factor, w - 0.5F * w / factor);
  const float y = std::clamp(at.y(), 0.5F * h / factor, h - 0.5F * h / factor);
  scale_ *= factor;
  cx_ = 0.5F * w + factor * (cx_ - x);
  cy_ = 0.5F * h + factor * (cy_ - y);
}

double Camera::frame_aspect() const {
  const double wide = static_cast<double>(high_x_) - static_cast<double>(low_x_);
  const double tall = static_cast<double>(high_y_) - static_cast<double>(low_y_);
  return wide > 0.0 && tall > 0.0 && std::isfinite(wide / tall) ? wide / tall : 1.0;
}

namespace {

constexpr int kSteps = 6;             // bins of normals: normal times this, rounded
constexpr std::size_t kSome = 16384;  // triangles kept, at most twice as many
constexpr double kAxisBase = 0.03;    // of the whole area; a ball has 0.02
constexpr double kLeastBase = 0.015;  // of the whole area
constexpr double kLeastDown = 0.5;    // cosine between a base's normal and an axis
constexpr double kAlike = 0.98;       // cosine between the normals of a base's triangles
constexpr double kThick = 0.02;       // of a base, in diagonals

std::array<int, 3> bin_of(const Vec3f& normal) {
  std::array<int, 3> bin{};
  for (int k = 0; k < 3; ++k) {
    bin[static_cast<std::size_t>(k)] = static_cast<int>(std::lround(normal[k] * kSteps));
  }
  return bin;
}

}  // namespace

int UpAxisGuess::axis() const {
  const Vec3d tilted = tilt();
  if (!tilted.isZero(0.0)) {
    return tilted.z() > tilted.y() ? 2 : 1;
  }
  return base_[2] > base_[1] + 0.02 * area_ ? 2 : 1;
}

Vec3d UpAxisGuess::tilt() const {
  if (std::max(base_[1], base_[2]) > kAxisBase * area_) {
    return Vec3d::Zero();
  }
  // Directions that much of the surface faces.
  std::map<std::array<int, 3>, Vec3d> bins;
  double whole = 0.0;
  for (const Facet& f : some_) {
    const double size = static_cast<double>(f.area.norm());
    whole += size;
    if (std::max(-f.area.y(), -f.area.z()) > static_cast<float>(kLeastDown * size)) {
      const auto [bin, fresh] = bins.try_emplace(bin_of(f.area / f.area.norm()), Vec3d::Zero());
      bin->second += f.area.cast<double>();
    }
  }
  std::vector<Vec3d> sums;
  for (const auto& [bin, sum] : bins) {
    if (sum.norm() > kLeastBase * whole) {
      sums.push_back(sum);
    }
  }
  // The base is what lies outermost in such a direction.
  const double thick = kThick * (high_ - low_).norm();
  Vec3d base = Vec3d::Zero();
  for (const Vec3d& sum : sums) {
    const Vec3d n = sum.normalized();
    double outermost = -std::numeric_limits<double>::infinity();
    for (const Facet& f : some_) {
      outermost = std::max(outermost, n.dot(f.middle.cast<double>()));
    }
    Vec3d flat = Vec3d::Zero();
    for (const Facet& f : some_) {
      const Vec3d area = f.area.cast<double>();
      if (n.dot(area) > kAlike * area.norm() &&
          n.dot(f.middle.cast<double>()) > outermost - thick) {
        flat += area;
      }
    }
    base = flat.norm() > std::max(base.norm(), kLeastBase * whole) ? flat : base;
  }
  return base.isZero(0.0) ? base : Vec3d(-base.normalized());
}

Camera::View UpAxisGuess::view() const {
  const int up = axis();
  Camera::View view = Camera::default_view(low_, high_, up);
  if (view.up_axis == up) {
    view.up = tilt();
  }
  return view;
}

void UpAxisGuess::add(std::span<const Vec3f> positions, std::span<const LocalTriangle> triangles) {
  const Vec3d slab = low_ + 0.02 * (high_ - low_);
  for (const LocalTriangle& t : triangles) {
    const Vec3d p = positions[t[0]].cast<double>();
    const Vec3d q = positions[t[1]].cast<double>();
    const Vec3d r = positions[t[2]].cast<double>();
    const Vec3d area = (q - p).cross(r - p);
    const double size = area.norm();
    if (!(size > 0.0)) {
      continue;
    }
    area_ += size;
    if (skip_-- == 0) {
      some_.push_back({((p + q + r) / 3.0).cast<float>(), area.cast<float>()});
      if (some_.size() == 2 * kSome) {
        for (std::size_t i = 0; i < kSome; ++i) {
          some_[i] = some_[2 * i];
        }
        some_.resize(kSome);
        stride_ *= 2;
      }
      skip_ = stride_ - 1;
    }
    for (int k = 1; k < 3; ++k) {
      if (area[k] < -0.95 * size && std::max({p[k], q[k], r[k]}) < slab[k]) {
        base_[k] += size;
      }
    }
  }
}

}  // namespace rattan
