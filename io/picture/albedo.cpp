// SPDX-License-Identifier: MIT
#include "io/picture/albedo.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace rattan {
namespace {

using Vec2f = Eigen::Vector2f;

constexpr Rgb kLineColour{28, 31, 38};
constexpr Rgb kIsoColour{20, 62, 120};
constexpr Rgb kInsideColour{164, 140, 128};
constexpr Rgb kTriangleTint{236, 176, 96};
constexpr Rgb kPolygonTint{150, 190, 140};
constexpr Rgb kSingularTint{222, 72, 52};
constexpr Rgb kLightField{240, 236, 226};
constexpr Rgb kDarkField{66, 108, 150};

float segment_distance(const Vec2f& p, const Vec2f& a, const Vec2f& b) {
  const Vec2f ab = b - a;
  const float t = std::clamp((p - a).dot(ab) / std::max(ab.squaredNorm(), 1e-12F), 0.0F, 1.0F);
  return (p - a - t * ab).norm();
}

}  // namespace

/// Where a ray met the part.
struct Albedo::Place {
  std::size_t triangle;
  std::array<float, 3> weight;
  std::array<Vec2f, 3> corner;  // pixels
  Vec2f pixel;
  std::uint8_t kind;

  float value(const std::array<float, 3>& at_corner) const {
    return weight[0] * at_corner[0] + weight[1] * at_corner[1] + weight[2] * at_corner[2];
  }
  /// Change a pixel of what has these values at the corners. False for a triangle seen edge on.
  bool gradient(const std::array<float, 3>& at_corner, Vec2f& out) const {
    const Vec2f e1 = corner[1] - corner[0];
    const Vec2f e2 = corner[2] - corner[0];
    const float det = e1.x() * e2.y() - e1.y() * e2.x();
    if (!(std::abs(det) > 1e-12F)) {
      return false;
    }
    const float d1 = at_corner[1] - at_corner[0];
    const float d2 = at_corner[2] - at_corner[0];
    out = {(d1 * e2.y() - d2 * e1.y()) / det, (d2 * e1.x() - d1 * e2.x()) / det};
    return true;
  }
};

Rgb Albedo::at(Look look, const PartScene::Hit& hit, const Vec2f& pixel, bool inside) const {
  const Rgb colour = inside ? kInsideColour : options_.surface;
  const bool drawn = look != Look::kPlain && look != Look::kRawField && look != Look::kField;
  if (!drawn || inside) {
    return colour;
  }
  if (look == Look::kCharts) {
    return mesh_.tints.empty() ? colour : mesh_.tints[hit.triangle];
  }
  const LocalTriangle& t = mesh_.triangles[hit.triangle];
  Place place{hit.triangle, {1.0F - hit.u - hit.v, hit.u, hit.v}, {}, pixel, kPlainTriangle};
  for (std::size_t k = 0; k < 3; ++k) {
    place.corner[k] = camera_.project(positions_[t[k]]).head<2>();
  }
  place.kind = mesh_.kinds.empty() ? kPlainTriangle : mesh_.kinds[hit.triangle];
  return look == Look::kEdges     ? edges(colour, place)
         : look == Look::kTexture ? texture(colour, place)
                                  : iso_lines(colour, place);
}

Rgb Albedo::edges(Rgb colour, const Place& place) const {
  if (place.kind == kTriangleFace) {
    colour = mix(colour, kTriangleTint, 0.75F);
  } else if (place.kind == kPolygonFace) {
    colour = mix(colour, kPolygonTint, 0.75F);
  }
  if (mesh_.edges.empty()) {
    return colour;
  }
  float distance = 1e9F;
  for (std::size_t k = 0; k < 3; ++k) {
    if ((mesh_.edges[place.triangle] >> k & 1U) != 0) {
      distance = std::min(
          distance, segment_distance(place.pixel, place.corner[k], place.corner[(k + 1) % 3]));
    }
  }
  return mix(colour, kLineColour, 0.88F * coverage(distance));
}

Rgb Albedo::iso_lines(Rgb colour, const Place& place) const {
  if (place.kind == kSingularTriangle) {
    colour = mix(colour, kSingularTint, 0.8F);
  }
  if (mesh_.corner_phases.empty()) {
    return colour;
  }
  const auto* phases = &mesh_.corner_phases[3 * place.triangle];
  const auto period = static_cast<float>(options_.line_period);
  for (std::size_t k = 0; k < 2; ++k) {
    const std::array<float, 3> phase{phases[0][k], phases[1][k], phases[2][k]};
    Vec2f gradient;
    if (!place.gradient(phase, gradient)) {
      break;
    }
    const float turns = place.value(phase) / period;
    const float spacing = period / std::max(gradient.norm(), 1e-12F);  // pixels
    const float distance = std::abs(turns - std::round(turns)) * spacing;
    // Lines nearer to each other than two pixels would only darken the surface.
    const float fade = std::clamp((spacing - 2.0F) / 2.0F, 0.0F, 1.0F);
    if (std::isfinite(turns)) {
      colour = mix(colour, kIsoColour, 0.9F * fade * coverage(distance));
    }
  }
  return colour;
}

Rgb Albedo::texture(Rgb colour, const Place& place) const {
  if (mesh_.corner_uv.empty()) {
    return colour;
  }
  const auto* uv = &mesh_.corner_uv[3 * place.triangle];
  const std::array<float, 3> u{uv[0][0], uv[1][0], uv[2][0]};
  const std::array<float, 3> v{uv[0][1], uv[1][1], uv[2][1]};
  const float x = place.value(u);
  const float y = place.value(v);
  Vec2f du;
  Vec2f dv;
  if (!std::isfinite(x) || !std::isfinite(y) || !place.gradient(u, du) || !place.gradient(v, dv)) {
    return colour;
  }
  // What one sample stands for.
  const float wide = du.lpNorm<1>() / scale_;
  const float high = dv.lpNorm<1>() / scale_;
  if (options_.texture != nullptr) {
    return options_.texture->at(x, y, std::min(std::max(wide, high), 1.0F));
  }
  const float n = options_.checks;
  return mix(kDarkField, kLightField, light_share(n * x, n * y, n * wide, n * high));
}

/// Of a sample by a line whose middle is `distance` pixels away.
float Albedo::coverage(float distance) const {
  return std::clamp((0.5F * options_.line_width - distance) * scale_ + 0.5F, 0.0F, 1.0F);
}

}  // namespace rattan
