// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <vector>

#include <embree3/rtcore.h>

#include "io/picture/camera.h"
#include "io/picture/scene.h"

namespace rattan {

/// One part of the surface as an Embree scene in camera space.
class PartScene {
 public:
  PartScene(RTCDevice device, const SceneMesh& mesh, const Camera& camera);
  ~PartScene();
  PartScene(const PartScene&) = delete;
  PartScene& operator=(const PartScene&) = delete;

  struct Hit {
    std::uint32_t triangle;
    float u, v, depth;
  };
  /// From the eye along `direction` (z = 1), nearer than `depth`.
  bool intersect(const Vec3f& direction, float depth, Hit& hit) const;
  bool occluded(const Vec3f& origin, const Vec3f& direction, float reach) const;

  const std::vector<Vec3f>& positions() const { return positions_; }
  const Vec3f& low() const { return low_; }
  const Vec3f& high() const { return high_; }

 private:
  RTCScene scene_ = nullptr;
  std::vector<Vec3f> positions_;  // camera space
  Vec3f low_, high_;
};

/// Embree's device for as long as it lives. Throws ResourceError where Embree cannot start.
class RayDevice {
 public:
  RayDevice();
  ~RayDevice();
  RayDevice(const RayDevice&) = delete;
  RayDevice& operator=(const RayDevice&) = delete;
  RTCDevice get() const { return device_; }

 private:
  RTCDevice device_;
};

}  // namespace rattan
