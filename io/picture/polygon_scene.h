// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "engine/remesh/polygon_mesh.h"
#include "io/picture/render.h"
#include "io/picture/scene.h"

namespace rattan {

/// A polygon mesh as triangles with its face edges marked, smooth but for creases.
class PolygonScene {
 public:
  /// Positions become `mesh` position + shift. Normals are averaged over faces that meet at less
  /// than `crease` degrees.
  explicit PolygonScene(const PolygonMesh& mesh, const Vec3d& shift = Vec3d::Zero(),
                        double crease = 40.0);
  /// Refers to this object's arrays.
  SceneMesh mesh() const;
  /// A dot at each interior vertex where other than four edges meet: blue below four, red above.
  std::vector<Dot> irregular_vertices(const PolygonMesh& mesh, float radius) const;
  double mean_edge() const { return mean_edge_; }

 private:
  std::vector<Vec3f> positions_;
  std::vector<LocalTriangle> triangles_;
  std::vector<Vec3f> corner_normals_;
  std::vector<std::uint8_t> kinds_;
  std::vector<std::uint8_t> edges_;
  double mean_edge_ = 0.0;
};

/// Of its box. Single precision is near the surface, wherever that lies, once shifted by minus
/// this.
Vec3d middle_of(const PolygonMesh& mesh);

/// Fitted to the scene in a picture of options.width x options.height. `view` null: the default
/// one, with the wishes of `options`.
Camera camera_for(const PolygonScene& scene, const RenderOptions& options,
                  const Camera::View* view = nullptr);

/// Pixels that a length takes about the middle of the scene, where it faces the eye.
float pixels_of(double length, const Camera& camera);

/// Of a picture's smaller side.
inline constexpr double kMargin = 0.05;

}  // namespace rattan
