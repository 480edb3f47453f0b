// SPDX-License-Identifier: MIT
#include "io/picture/camera.h"

#include <algorithm>
#include <cmath>
#include <limits>

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
  const Vec3d up = Vec3d::Unit(view.up_axis);
  const Vec3d ahead = view.up_axis == 2 ? Vec3d(-Vec3d::Unit(1)) : Vec3d::Unit(view.up_axis + 1);
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

double Camera::frame_aspect() const {
  const double wide = static_cast<double>(high_x_) - static_cast<double>(low_x_);
  const double tall = static_cast<double>(high_y_) - static_cast<double>(low_y_);
  return wide > 0.0 && tall > 0.0 && std::isfinite(wide / tall) ? wide / tall : 1.0;
}

void UpAxisGuess::add(std::span<const Vec3f> positions, std::span<const LocalTriangle> triangles) {
  const Vec3d slab = low_ + 0.02 * (high_ - low_);
  for (const LocalTriangle& t : triangles) {
    const Vec3d p = positions[t[0]].cast<double>();
    const Vec3d q = positions[t[1]].cast<double>();
    const Vec3d r = positions[t[2]].cast<double>();
    const Vec3d area = (q - p).cross(r - p);
    const double size = area.norm();
    area_ += size;
    for (int k = 1; k < 3; ++k) {
      if (area[k] < -0.95 * size && std::max({p[k], q[k], r[k]}) < slab[k]) {
        base_[k] += size;
      }
    }
  }
}

}  // namespace rattan
