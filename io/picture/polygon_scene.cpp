// SPDX-License-Identifier: MIT
#include "io/picture/polygon_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Geometry>

namespace rattan {
namespace {

/// The corner whose fan folds the quad least; other polygons are cut from their first corner.
std::uint32_t apex_of(const PolygonMesh& mesh, std::span<const std::uint32_t> face,
                      const Vec3d& area) {
  if (face.size() != 4) {
    return 0;
  }
  const auto p = [&](std::size_t i) -> const Vec3d& { return mesh.positions[face[i % 4]]; };
  const auto worst = [&](std::size_t a) {
    return std::min((p(a + 1) - p(a)).cross(p(a + 2) - p(a)).dot(area),
                    (p(a + 2) - p(a)).cross(p(a + 3) - p(a)).dot(area));
  };
  return worst(1) > worst(0) ? 1 : 0;
}

}  // namespace

PolygonScene::PolygonScene(const PolygonMesh& mesh, const Vec3d& shift, double crease) {
  const std::size_t faces = mesh.face_count();
  positions_.reserve(mesh.vertex_count());
  for (const Vec3d& p : mesh.positions) {
    positions_.push_back((p + shift).cast<float>());
  }
  std::vector<Vec3d> face_normal(faces);
  std::vector<std::uint32_t> begin(mesh.vertex_count() + 1, 0);
  double length = 0.0;
  for (std::size_t f = 0; f < faces; ++f) {
    const auto face = mesh.face(f);
    Vec3d area = Vec3d::Zero();
    for (std::size_t i = 0; i < face.size(); ++i) {
      const Vec3d& a = mesh.positions[face[i]] - mesh.positions[face[0]];
      const Vec3d& b = mesh.positions[face[(i + 1) % face.size()]] - mesh.positions[face[0]];
      area += a.cross(b);
      length += (b - a).norm();
      ++begin[face[i] + 1];
    }
    face_normal[f] = area;
  }
  mean_edge_ = mesh.corners.empty() ? 0.0 : length / static_cast<double>(mesh.corners.size());
  for (std::size_t v = 0; v + 1 < begin.size(); ++v) {
    begin[v + 1] += begin[v];
  }
  std::vector<std::uint32_t> around(mesh.corners.size());
  std::vector<std::uint32_t> fill(begin.begin(), begin.end() - 1);
  for (std::size_t f = 0; f < faces; ++f) {
    for (const std::uint32_t v : mesh.face(f)) {
      around[fill[v]++] = static_cast<std::uint32_t>(f);
    }
  }
  const double least = std::cos(crease * std::numbers::pi / 180.0);
  const auto normal_at = [&](std::size_t f, std::uint32_t v) {
    Vec3d sum = Vec3d::Zero();
    const Vec3d own = face_normal[f].normalized();
    for (std::uint32_t i = begin[v]; i < begin[v + 1]; ++i) {
      const Vec3d& other = face_normal[around[i]];
      if (other.dot(own) >= least * other.norm()) {
        sum += other;
      }
    }
    return Vec3f(sum.normalized().cast<float>());
  };
  // Where quads are the rule, what is none stands out; a triangle mesh stays plain.
  std::size_t quads = 0;
  for (std::size_t f = 0; f < faces; ++f) {
    quads += mesh.degree(f) == 4 ? 1 : 0;
  }
  const bool tint = 2 * quads >= faces;
  std::vector<Vec3f> corner;
  for (std::size_t f = 0; f < faces; ++f) {
    const auto face = mesh.face(f);
    const std::size_t n = face.size();
    const std::uint32_t apex = apex_of(mesh, face, face_normal[f]);
    corner.clear();
    for (const std::uint32_t v : face) {
      corner.push_back(normal_at(f, v));
    }
    for (std::size_t t = 0; t + 2 < n; ++t) {
      const std::size_t c[3] = {apex, (apex + t + 1) % n, (apex + t + 2) % n};
      triangles_.push_back({face[c[0]], face[c[1]], face[c[2]]});
      for (const std::size_t k : c) {
        corner_normals_.push_back(corner[k]);
      }
      kinds_.push_back(!tint || n == 4 ? kPlainTriangle : n == 3 ? kTriangleFace : kPolygonFace);
      edges_.push_back(static_cast<std::uint8_t>((t == 0 ? 1U : 0U) | 2U | (t + 3 == n ? 4U : 0U)));
    }
  }
}

SceneMesh PolygonScene::mesh() const {
  SceneMesh out;
  out.positions = positions_;
  out.triangles = triangles_;
  out.corner_normals = corner_normals_;
  out.kinds = kinds_;
  out.edges = edges_;
  return out;
}

std::vector<Dot> PolygonScene::irregular_vertices(const PolygonMesh& mesh, float radius) const {
  std::vector<std::uint32_t> valence(mesh.vertex_count(), 0);
  std::vector<std::uint8_t> boundary(mesh.vertex_count(), 0);
  std::vector<std::uint64_t> directed;
  directed.reserve(mesh.corners.size());
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const auto face = mesh.face(f);
    for (std::size_t i = 0; i < face.size(); ++i) {
      ++valence[face[i]];
      directed.push_back(std::uint64_t{face[i]} << 32 | face[(i + 1) % face.size()]);
    }
  }
  std::sort(directed.begin(), directed.end());
  for (const std::uint64_t edge : directed) {
    if (!std::binary_search(directed.begin(), directed.end(), edge << 32 | edge >> 32)) {
      boundary[edge >> 32] = boundary[edge & 0xffffffffU] = 1;
    }
  }
  std::vector<Dot> dots;
  for (std::size_t v = 0; v < valence.size(); ++v) {
    if (valence[v] != 4 && valence[v] != 0 && boundary[v] == 0) {
      dots.push_back({positions_[v], valence[v] < 4 ? Rgb{38, 98, 190} : Rgb{206, 56, 44}, radius});
    }
  }
  return dots;
}

Vec3d middle_of(const PolygonMesh& mesh) {
  Vec3d low = Vec3d::Constant(std::numeric_limits<double>::infinity());
  Vec3d high = -low;
  for (const Vec3d& p : mesh.positions) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return 0.5 * (low + high);
}

Camera camera_for(const PolygonScene& scene, const RenderOptions& options,
                  const Camera::View* view) {
  const SceneMesh mesh = scene.mesh();
  Vec3d low = Vec3d::Constant(std::numeric_limits<double>::infinity());
  Vec3d high = -low;
  for (const Vec3f& p : mesh.positions) {
    low = low.cwiseMin(p.cast<double>());
    high = high.cwiseMax(p.cast<double>());
  }
  UpAxisGuess up(low, high);
  up.add(mesh.positions, mesh.triangles);
  Camera camera(low, high, view != nullptr ? *view : options.view.applied_to(up.view()));
  camera.include(mesh.positions);
  camera.fit(options.width, options.height, kMargin);
  return camera;
}

float pixels_of(double length, const Camera& camera) {
  const auto depth = static_cast<float>(2.6 * camera.diagonal());
  return camera.project({static_cast<float>(length), 0.0F, depth}).x() -
         camera.project({0.0F, 0.0F, depth}).x();
}

}  // namespace rattan
