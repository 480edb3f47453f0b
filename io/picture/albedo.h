// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "io/picture/part_scene.h"
#include "io/picture/render.h"

namespace rattan {

/// The colours of one part of a surface, drawing included, before light falls on it.
class Albedo {
 public:
  /// `positions`: the mesh's, in camera space. Refers to all that is given.
  Albedo(const SceneMesh& mesh, const std::vector<Vec3f>& positions, const Camera& camera,
         const RenderOptions& options)
      : mesh_(mesh),
        positions_(positions),
        camera_(camera),
        options_(options),
        scale_(static_cast<float>(options.samples)) {}

  /// Of the sample at `pixel`; `inside`: the surface turns its back to the eye.
  Rgb at(Look look, const PartScene::Hit& hit, const Eigen::Vector2f& pixel, bool inside) const;

 private:
  struct Place;
  Rgb edges(Rgb colour, const Place& place) const;
  Rgb iso_lines(Rgb colour, const Place& place) const;
  Rgb texture(Rgb colour, const Place& place) const;
  float coverage(float distance) const;

  const SceneMesh& mesh_;
  const std::vector<Vec3f>& positions_;
  const Camera& camera_;
  const RenderOptions& options_;
  float scale_;
};

}  // namespace rattan
