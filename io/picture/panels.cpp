// SPDX-License-Identifier: MIT
#include "io/picture/panels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "engine/core/errors.h"
#include "io/picture/polygon_scene.h"

namespace rattan {
namespace {

constexpr Rgb kInk{58, 60, 66};

constexpr std::size_t kMostInRow = 4;
constexpr float kCloseUpEdge = 38.0F;  // pixels
constexpr int kMostFields = 8;
constexpr float kLeastField = 7.0F;  // pixels
constexpr float kLeastEdge = 3.5F;   // pixels; lines nearer than this hide what is between them

float edge_pixels(const PolygonScene& scene, const Camera& camera) {
  return pixels_of(scene.mean_edge(), camera);
}

/// Fields of a checkerboard a chart side: even, so that it goes on across borders; as many as 8 if
/// they can be told apart.
int fields_of_chart(float side_pixels, int units) {
  int fields = kMostFields;
  while (fields > 2 * units && side_pixels < kLeastField * static_cast<float>(fields)) {
    fields /= 2;
  }
  return fields;
}

/// Thinner lines and smaller dots where the faces are small on the picture.
struct Strength {
  float line;
  float dot;
};

Strength strength(const PolygonScene& scene, const Camera& camera, const RenderOptions& options) {
  const float edge = edge_pixels(scene, camera);
  return {std::clamp(0.1F * edge, 0.45F, options.line_width), std::min(0.24F * edge, 3.4F)};
}

Image polygons_image(const PolygonScene& scene, std::span<const Dot> dots, const Camera& camera,
                     RenderOptions options, Look look = Look::kEdges) {
  options.line_width = strength(scene, camera, options).line;
  return std::move(render(single_part(scene.mesh()), camera, {&look, 1}, dots, options).front());
}

/// The remesh, with dots unless they were so small that they would only colour the surface.
Image remesh_image(const PanelInput& input, const PolygonScene& scene, const Camera& camera,
                   const RenderOptions& options) {
  std::vector<Dot> dots;
  if (const float radius = strength(scene, camera, options).dot;
      input.irregular_dots && radius >= 1.2F) {
    dots = scene.irregular_vertices(*input.remesh, radius);
  }
  return polygons_image(scene, dots, camera, options);
}

/// What a close-up shows: of the irregular vertices (or all, if there are none) one near to the eye
/// and to the middle of the picture.
Vec3f near_point(const PolygonMesh& mesh, const PolygonScene& scene, const Camera& camera,
                 const RenderOptions& options) {
  Vec3f best = Vec3f::Zero();
  float least = std::numeric_limits<float>::infinity();
  const auto look = [&](const Vec3f& p) {
    const Vec3f at = camera.project(camera.to_camera(p));
    const float aside = std::hypot(at.x() / static_cast<float>(options.width) - 0.5F,
                                   at.y() / static_cast<float>(options.height) - 0.5F);
    const float far = at.z() / static_cast<float>(camera.diagonal()) + aside;
    if (far < least) {
      least = far;
      best = p;
    }
  };
  for (const Dot& dot : scene.irregular_vertices(mesh, 1.0F)) {
    look(dot.position);
  }
  if (!std::isfinite(least)) {
    for (const Vec3f& p : scene.mesh().positions) {
      look(p);
    }
  }
  return best;
}

/// Rows of panels of one size, each with its label below.
Image arrange(const std::vector<std::pair<Image, std::string>>& panels,
              const RenderOptions& options, float text_height) {
  const int foot = static_cast<int>(std::lround(3.2F * text_height));
  const std::size_t rows = (panels.size() + kMostInRow - 1) / kMostInRow;
  const std::size_t columns = (panels.size() + rows - 1) / rows;
  Image strip(options.width * static_cast<int>(columns),
              (options.height + foot) * static_cast<int>(rows), options.background);
  for (std::size_t i = 0; i < panels.size(); ++i) {
    const int left = options.width * static_cast<int>(i % columns);
    const int top = (options.height + foot) * static_cast<int>(i / columns);
    strip.paste(panels[i].first, left, top);
    const std::string& label = panels[i].second;
    const float x = static_cast<float>(left) +
                    0.5F * (static_cast<float>(options.width) - text_width(label, text_height));
    const float y = static_cast<float>(top + options.height) + 1.6F * text_height;
    draw_text(strip, label, {x, y}, text_height, kInk);
  }
  return strip;
}

}  // namespace

Image render_panels(const PanelInput& input, const RenderOptions& most, const Camera::View* view) {
  RenderOptions options = most;
  ensure(static_cast<bool>(input.scan) || input.remesh != nullptr, "a picture shows something");
  const SurfaceSource& shape = input.shape ? input.shape : input.scan;
  std::optional<PolygonScene> remesh;
  if (input.remesh != nullptr) {
    remesh.emplace(*input.remesh, input.remesh_shift);
  }
  Camera::View from;
  if (view != nullptr) {
    from = *view;
  } else {
    UpAxisGuess up(input.low, input.high);
    if (shape) {
      shape([&](const SceneMesh& mesh) { up.add(mesh.positions, mesh.triangles); });
    } else {
      up.add(remesh->mesh().positions, remesh->mesh().triangles);
    }
    from = options.view.applied_to(up.view());
  }
  Camera camera(input.low, input.high, from);
  if (shape) {
    shape([&](const SceneMesh& mesh) { camera.include(mesh.positions); });
  }
  if (remesh) {
    camera.include(remesh->mesh().positions);
  }
  // Tall things get narrow panels, wide things low ones.
  const double wide = camera.frame_aspect() + 2.0 * kMargin;
  const double tall = 1.0 / camera.frame_aspect() + 2.0 * kMargin;
  options.width = std::clamp(static_cast<int>(std::lround(wide * most.height)),
                             std::min(most.width, most.height / 2), most.width);
  options.height = std::clamp(static_cast<int>(std::lround(tall * options.width)),
                              std::min(most.height, most.width / 2), most.height);
  camera.fit(options.width, options.height, kMargin);

  std::vector<std::pair<Image, std::string>> panels;
  if (input.scan) {
    std::vector<Look> looks{Look::kPlain};
    std::vector<std::string> labels{input.scan_label};
    if (input.has_curvature) {
      looks.push_back(Look::kRawField);
      labels.push_back(input.curvature_label);
    }
    if (input.has_field) {
      looks.push_back(Look::kField);
      labels.push_back(input.field_label);
    }
    if (input.has_lines) {
      looks.push_back(Look::kIsoLines);
      labels.push_back(input.lines_label);
    }
    std::vector<Dot> dots = input.singularities;
    if (remesh) {
      for (Dot& dot : dots) {
        dot.radius = std::min(dot.radius, strength(*remesh, camera, options).dot);
      }
    }
    Overlay overlay;
    static constexpr std::array kOfCharts{Look::kCharts, Look::kTexture};
    if (input.charts) {
      overlay = {input.charts, kOfCharts};
      labels.push_back(input.charts_label);
      labels.push_back(input.texture_label);
      options.checks = static_cast<float>(fields_of_chart(pixels_of(input.chart_side, camera),
                                                          input.chart_units)) /
                       static_cast<float>(input.chart_units);
    }
    std::vector<Image> images = render(input.scan, camera, looks, dots, options, overlay);
    for (std::size_t i = 0; i < images.size(); ++i) {
      panels.emplace_back(std::move(images[i]), labels[i]);
    }
  }
  if (remesh) {
    panels.emplace_back(remesh_image(input, *remesh, camera, options), input.remesh_label);
    if (input.close_up) {
      const float factor = kCloseUpEdge / std::max(edge_pixels(*remesh, camera), 1e-3F);
      camera.zoom(near_point(*input.remesh, *remesh, camera, options),
                  std::clamp(factor, 2.0F, 10.0F), options.width, options.height);
      panels.emplace_back(remesh_image(input, *remesh, camera, options), input.close_up_label);
    }
  }
  return arrange(panels, options, std::max(9.0F, 0.019F * static_cast<float>(most.height)));
}

Image render_polygons(const PolygonMesh& mesh, const RenderOptions& options,
                      const Camera::View* view, EdgeDrawing edges) {
  ensure(mesh.face_count() > 0, "a picture shows something");
  const PolygonScene scene(mesh, -middle_of(mesh));
  const Camera camera = camera_for(scene, options, view);
  const bool drawn = edges == EdgeDrawing::kAlways ||
                     (edges == EdgeDrawing::kFit && edge_pixels(scene, camera) >= kLeastEdge);
  return polygons_image(scene, {}, camera, options, drawn ? Look::kEdges : Look::kPlain);
}

}  // namespace rattan
