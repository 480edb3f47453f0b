// SPDX-License-Identifier: MIT
#include "io/picture/panels.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "engine/core/errors.h"
#include "io/picture/polygon_scene.h"

namespace rattan {
namespace {

constexpr Rgb kInk{58, 60, 66};
constexpr double kMargin = 0.05;  // of a panel's smaller side

/// Thinner lines and smaller dots where the faces are small on the picture.
struct Strength {
  float line;
  float dot;
};

Strength strength(const PolygonScene& scene, const Camera& camera, const RenderOptions& options) {
  const Vec3f a = camera.project({0.0F, 0.0F, static_cast<float>(2.6 * camera.diagonal())});
  const Vec3f b = camera.project(
      {static_cast<float>(scene.mean_edge()), 0.0F, static_cast<float>(2.6 * camera.diagonal())});
  const float edge = b.x() - a.x();  // pixels
  return {std::clamp(0.12F * edge, 0.45F, options.line_width), std::min(0.27F * edge, 3.4F)};
}

Image polygons_image(const PolygonScene& scene, std::span<const Dot> dots, const Camera& camera,
                     RenderOptions options) {
  options.line_width = strength(scene, camera, options).line;
  const Look look = Look::kEdges;
  return std::move(render(single_part(scene.mesh()), camera, {&look, 1}, dots, options).front());
}

}  // namespace

Image render_panels(const PanelInput& input, const RenderOptions& most, const Camera::View* view) {
  RenderOptions options = most;
  ensure(static_cast<bool>(input.scan) || input.remesh != nullptr, "a picture shows something");
  std::optional<PolygonScene> remesh;
  if (input.remesh != nullptr) {
    remesh.emplace(*input.remesh, input.remesh_shift);
  }
  Camera::View from;
  if (view != nullptr) {
    from = *view;
  } else {
    UpAxisGuess up(input.low, input.high);
    if (input.scan) {
      input.scan([&](const SceneMesh& mesh) { up.add(mesh.positions, mesh.triangles); });
    } else {
      up.add(remesh->mesh().positions, remesh->mesh().triangles);
    }
    from = Camera::default_view(input.low, input.high, up.axis());
  }
  Camera camera(input.low, input.high, from);
  if (input.scan) {
    input.scan([&](const SceneMesh& mesh) { camera.include(mesh.positions); });
  }
  if (remesh) {
    camera.include(remesh->mesh().positions);
  }
  // Tall things get narrow panels.
  const double aspect = camera.frame_aspect() + 2.0 * kMargin;
  options.width = std::clamp(static_cast<int>(std::lround(aspect * options.height)),
                             std::min(options.width, options.height / 2), options.width);
  camera.fit(options.width, options.height, kMargin);

  std::vector<std::pair<Image, std::string>> panels;
  if (input.scan) {
    std::vector<Look> looks{Look::kPlain};
    std::vector<std::string> labels{input.scan_label};
    if (input.has_field) {
      looks.push_back(Look::kField);
      labels.push_back(input.field_label);
    }
    if (input.has_lines) {
      looks.push_back(Look::kIsoLines);
      labels.push_back(input.lines_label);
    }
    std::vector<Image> images = render(input.scan, camera, looks, input.singularities, options);
    for (std::size_t i = 0; i < images.size(); ++i) {
      panels.emplace_back(std::move(images[i]), labels[i]);
    }
  }
  if (remesh) {
    std::vector<Dot> dots;
    // Dots smaller than a pixel or so would only colour the surface.
    if (const float radius = strength(*remesh, camera, options).dot;
        input.irregular_dots && radius >= 1.2F) {
      dots = remesh->irregular_vertices(*input.remesh, radius);
    }
    panels.emplace_back(polygons_image(*remesh, dots, camera, options), input.remesh_label);
  }

  const float text_height = std::max(9.0F, 0.019F * static_cast<float>(options.height));
  const int foot = static_cast<int>(std::lround(3.2F * text_height));
  Image strip(options.width * static_cast<int>(panels.size()), options.height + foot,
              options.background);
  for (std::size_t i = 0; i < panels.size(); ++i) {
    const int left = options.width * static_cast<int>(i);
    strip.paste(panels[i].first, left, 0);
    const std::string& label = panels[i].second;
    const float x = static_cast<float>(left) +
                    0.5F * (static_cast<float>(options.width) - text_width(label, text_height));
    const float y = static_cast<float>(options.height) + 1.6F * text_height;
    draw_text(strip, label, {x, y}, text_height, kInk);
  }
  return strip;
}

Image render_polygons(const PolygonMesh& mesh, const RenderOptions& options,
                      const Camera::View* view) {
  ensure(mesh.face_count() > 0, "a picture shows something");
  Vec3d low = Vec3d::Constant(std::numeric_limits<double>::infinity());
  Vec3d high = -low;
  for (const Vec3d& p : mesh.positions) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  // Single precision near the surface, wherever it lies.
  const Vec3d middle = 0.5 * (low + high);
  const PolygonScene scene(mesh, -middle);
  UpAxisGuess up(low - middle, high - middle);
  up.add(scene.mesh().positions, scene.mesh().triangles);
  const Camera::View from = view != nullptr ? *view : Camera::default_view(low, high, up.axis());
  Camera camera(low - middle, high - middle, from);
  camera.include(scene.mesh().positions);
  camera.fit(options.width, options.height, kMargin);
  return polygons_image(scene, {}, camera, options);
}

}  // namespace rattan
