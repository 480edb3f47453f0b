// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "engine/remesh/polygon_mesh.h"
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

}  // namespace rattan
