// SPDX-License-Identifier: MIT
#include "io/picture/part_scene.h"

#include <cstring>
#include <limits>

#include "engine/core/errors.h"

namespace rattan {

RayDevice::RayDevice() : device_(rtcNewDevice(nullptr)) {
  if (device_ == nullptr) {
    throw ResourceError("Embree cannot start, so no picture can be made. Leave out the picture.");
  }
}

RayDevice::~RayDevice() {
  rtcReleaseDevice(device_);
}

PartScene::PartScene(RTCDevice device, const SceneMesh& mesh, const Camera& camera)
    : low_(Vec3f::Constant(std::numeric_limits<float>::infinity())), high_(-low_) {
  positions_.reserve(mesh.positions.size());
  for (const Vec3f& p : mesh.positions) {
    positions_.push_back(camera.to_camera(p));
    low_ = low_.cwiseMin(positions_.back());
    high_ = high_.cwiseMax(positions_.back());
  }
  scene_ = rtcNewScene(device);
  // Robust: no ray slips through between two triangles.
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_LOW);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           sizeof(Vec3f), positions_.size());
  void* triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            sizeof(LocalTriangle), mesh.triangles.size());
  const bool empty = positions_.empty() || mesh.triangles.empty();
  if (!empty && (vertices == nullptr || triangles == nullptr)) {
    rtcReleaseGeometry(geometry);
    rtcReleaseScene(scene_);
    throw ResourceError("Memory ran out while making a picture. Leave out the picture.");
  }
  if (!empty) {
    std::memcpy(vertices, static_cast<const void*>(positions_.data()),
                positions_.size() * sizeof(Vec3f));
    std::memcpy(triangles, mesh.triangles.data(), mesh.triangles.size() * sizeof(LocalTriangle));
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
  }
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_);
}

PartScene::~PartScene() {
  rtcReleaseScene(scene_);
}

bool PartScene::intersect(const Vec3f& direction, float depth, Hit& hit) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit ray{};
  ray.ray.dir_x = direction.x();
  ray.ray.dir_y = direction.y();
  ray.ray.dir_z = direction.z();
  ray.ray.tfar = depth;
  ray.ray.mask = ~0U;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene_, &context, &ray);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID || !(ray.ray.tfar < depth)) {
    return false;
  }
  hit = {ray.hit.primID, ray.hit.u, ray.hit.v, ray.ray.tfar};
  return true;
}

bool PartScene::occluded(const Vec3f& origin, const Vec3f& direction, float reach) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray{};
  ray.org_x = origin.x();
  ray.org_y = origin.y();
  ray.org_z = origin.z();
  ray.dir_x = direction.x();
  ray.dir_y = direction.y();
  ray.dir_z = direction.z();
  ray.tfar = reach;
  ray.mask = ~0U;
  rtcOccluded1(scene_, &context, &ray);
  return ray.tfar < 0.0F;
}

}  // namespace rattan
