// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "engine/core/types.h"

namespace rattan {

/// A mildly perspective camera. Camera space: x right, y up, z the distance along the view.
class Camera {
 public:
  /// From where the middle of a box is looked at.
  struct View {
    int up_axis = 1;         ///< 0, 1, 2 for x, y, z
    double azimuth = 0.5;    ///< radians about the up axis, from the front to the right
    double elevation = 0.3;  ///< radians above the ground plane
    /// Unit; the exact way up of what stands askew in its coordinates. Zero: the axis itself.
    Vec3d up{0.0, 0.0, 0.0};
  };
  /// Three-quarter view of a box with the given axis up; a flat one is seen from above, whatever
  /// its thinnest axis. With y up the front faces z, with z up it faces -y, as scanners and
  /// modellers have it.
  static View default_view(const Vec3d& low, const Vec3d& high, int up_axis = 1);

  Camera(const Vec3d& low, const Vec3d& high, const View& view);

  /// Camera space.
  Vec3f to_camera(const Vec3f& world) const {
    const Vec3d p = world.cast<double>() - eye_;
    return Vec3d(right_.dot(p), up_.dot(p), forward_.dot(p)).cast<float>();
  }
  Vec3f turn(const Vec3f& direction) const {
    const Vec3d d = direction.cast<double>();
    return Vec3d(right_.dot(d), up_.dot(d), forward_.dot(d)).cast<float>();
  }

  /// Widens the picture's frame so that these points (world) are in it; start_frame() empties it.
  void start_frame();
  void include(std::span<const Vec3f> points);
  /// The frame in a picture of width x height with a margin (a fraction of the smaller side).
  void fit(int width, int height, double margin);
  /// Enlarges the picture `factor` (at least 1) times around a point (world), as far as that shows
  /// nothing beyond the picture before. After fit().
  void zoom(const Vec3f& point, float factor, int width, int height);
  /// Width over height of what the frame holds.
  double frame_aspect() const;

  /// Picture coordinates (pixels, y down) of a point in camera space; z stays.
  Vec3f project(const Vec3f& p) const {
    return {cx_ + scale_ * p.x() / p.z(), cy_ - scale_ * p.y() / p.z(), p.z()};
  }
  /// Camera-space direction through a picture coordinate; its z is 1.
  Vec3f ray(float x, float y) const { return {(x - cx_) / scale_, (cy_ - y) / scale_, 1.0F}; }

  /// Length of the box's diagonal.
  double diagonal() const { return diagonal_; }

 private:
  Vec3d eye_;
  Vec3d right_, up_, forward_;
  double diagonal_ = 1.0;
  float low_x_ = 0.0F, high_x_ = 0.0F, low_y_ = 0.0F, high_y_ = 0.0F;  // of x / z and y / z
  float scale_ = 1.0F, cx_ = 0.0F, cy_ = 0.0F;
};

/// What the user wants otherwise than the default view has it; radians.
struct ViewWish {
  std::optional<int> up_axis;
  std::optional<double> azimuth;
  std::optional<double> elevation;

  Camera::View applied_to(Camera::View view) const {
    if (up_axis) {
      view = Camera::View{};
      view.up_axis = *up_axis;
    }
    view.azimuth = azimuth.value_or(view.azimuth);
    view.elevation = elevation.value_or(view.elevation);
    return view;
  }
};

/// Guesses what is up, from a pass over the surface: what stands has a flat base.
class UpAxisGuess {
 public:
  UpAxisGuess(const Vec3d& low, const Vec3d& high) : low_(low), high_(high) {}
  void add(std::span<const Vec3f> positions, std::span<const LocalTriangle> triangles);
  /// z where clearly more of the surface lies flat at the bottom that way; else y.
  int axis() const;
  /// The normal of a flat base that everything stands on, turned inward, if it lies askew and is
  /// below in y or z; zero if the axis says all.
  Vec3d tilt() const;
  /// The default view of the box with what was found to be up.
  Camera::View view() const;

 private:
  struct Facet {
    Vec3f middle;
    Vec3f area;  ///< normal times area, times two
  };

  Vec3d low_, high_;
  Vec3d base_{0.0, 0.0, 0.0};  // area facing down within the lowest part of the box, each axis
  double area_ = 0.0;
  std::vector<Facet> some_;  // every stride_-th triangle
  std::size_t stride_ = 1;
  std::size_t skip_ = 0;
};

}  // namespace rattan
