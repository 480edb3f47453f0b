// SPDX-License-Identifier: MIT
#include "io/picture/surface_lines.h"

#include <algorithm>
#include <cmath>

#include "engine/core/parallel.h"

namespace rattan {
namespace {

constexpr std::size_t kRows = 48;
constexpr float kMostCover = 63.0F;
constexpr Rgb kBorderInk{26, 29, 36};
constexpr Rgb kSingularInk{206, 44, 32};
constexpr Rgb kEdgeInk{226, 120, 20};

}  // namespace

LineStyles line_styles(Look look, float width) {
  LineStyles styles{};
  const auto style = [&](LineKind kind) -> LineStyle& {
    return styles[static_cast<std::size_t>(kind)];
  };
  if (look == Look::kCharts) {
    style(LineKind::kChartBorder) = {1.25F * width, 0.85F, kBorderInk};
    style(LineKind::kSingularBorder) = {1.9F * width, 0.95F, kSingularInk};
  } else if (look == Look::kTexture) {
    style(LineKind::kChartBorder) = {1.25F * width, 0.9F, kBorderInk};
    style(LineKind::kSingularBorder) = style(LineKind::kChartBorder);
    style(LineKind::kPartBorder) = {0.8F * width, 0.6F, kBorderInk};
  } else if (look == Look::kIsoLines) {
    style(LineKind::kSingularEdge) = {1.9F * width, 0.95F, kEdgeInk};
  }
  return styles;
}

/// In the picture.
struct LineLayer::Flat {
  Vec3f a, b;  // pixels, and depth
  std::uint8_t kind;
};

LineLayer::LineLayer(const SampleGrid& grid, const Camera& camera, const LineStyles& styles)
    : grid_(grid), camera_(camera), styles_(styles), cover_(grid.depth.size(), 0) {}

void LineLayer::add(std::span<const SurfaceLine> lines) {
  std::vector<Flat> flat;
  const auto outside = [](float a, float b, int size) {
    return std::max(a, b) < -8.0F || std::min(a, b) > static_cast<float>(size) + 8.0F;
  };
  for (const SurfaceLine& line : lines) {
    const auto kind = static_cast<std::uint8_t>(line.kind);
    const Vec3f from = camera_.to_camera(line.from);
    const Vec3f to = camera_.to_camera(line.to);
    if (styles_[kind].width <= 0.0F || !(from.z() > 0.0F) || !(to.z() > 0.0F)) {
      continue;
    }
    const Flat f{camera_.project(from), camera_.project(to), kind};
    if (!outside(f.a.x(), f.b.x(), grid_.width) && !outside(f.a.y(), f.b.y(), grid_.height)) {
      flat.push_back(f);
    }
  }
  parallel_chunks(
      static_cast<std::size_t>(grid_.height) * static_cast<std::size_t>(grid_.samples),
      [&](std::size_t begin, std::size_t end) {
        for (const Flat& line : flat) {
          draw(line, static_cast<int>(begin), static_cast<int>(end));
        }
      },
      kRows);
}

void LineLayer::draw(const Flat& line, int first_row, int last_row) {
  const auto scale = static_cast<float>(grid_.samples);
  const float half = 0.5F * styles_[line.kind].width;
  const float reach = half + 0.5F / scale;
  const Vec3f d = line.b - line.a;
  const float length2 = std::max(d.head<2>().squaredNorm(), 1e-12F);
  // A pixel's side on the surface where that faces the eye.
  const float depth = 0.5F * (line.a.z() + line.b.z());
  const float pixel =
      1.0F / (camera_.project({1.0F, 0.0F, depth}).x() - camera_.project({0.0F, 0.0F, depth}).x());
  const auto row = [&](float y) { return static_cast<int>(std::floor(y * scale)); };
  const int y0 = std::max(first_row, row(std::min(line.a.y(), line.b.y()) - reach));
  const int y1 = std::min(last_row, row(std::max(line.a.y(), line.b.y()) + reach) + 1);
  for (int y = y0; y < y1; ++y) {
    const float py = (static_cast<float>(y) + 0.5F) / scale;
    // The stretch of the line near this row.
    float t0 = 0.0F;
    float t1 = 1.0F;
    if (std::abs(d.y()) > 1e-6F) {
      const float s = (py - reach - line.a.y()) / d.y();
      const float e = (py + reach - line.a.y()) / d.y();
      t0 = std::clamp(std::min(s, e), 0.0F, 1.0F);
      t1 = std::clamp(std::max(s, e), 0.0F, 1.0F);
    }
    const float xa = line.a.x() + t0 * d.x();
    const float xb = line.a.x() + t1 * d.x();
    const int most = grid_.width * grid_.samples;
    const int x0 = std::clamp(row(std::min(xa, xb) - reach), 0, most);
    const int x1 = std::clamp(row(std::max(xa, xb) + reach) + 1, 0, most);
    for (int x = x0; x < x1; ++x) {
      const float px = (static_cast<float>(x) + 0.5F) / scale;
      const float along = (px - line.a.x()) * d.x() + (py - line.a.y()) * d.y();
      const float t = std::clamp(along / length2, 0.0F, 1.0F);
      const float away = std::hypot(px - line.a.x() - t * d.x(), py - line.a.y() - t * d.y());
      const float cover = std::clamp((half - away) * scale + 0.5F, 0.0F, 1.0F);
      if (!(cover > 0.0F)) {
        continue;
      }
      const std::size_t at =
          static_cast<std::size_t>(y) * grid_.fine_width() + static_cast<std::size_t>(x);
      if (!grid_.inside.empty() && grid_.inside[at] != 0) {
        continue;
      }
      // How far the surface may fall away within the line's width.
      const float facing = std::max(std::abs(grid_.normal(at).z()), 0.15F);
      const float slack = pixel * (1.0F + (half + 0.5F) / facing);
      if (!(std::abs(grid_.depth[at] - (line.a.z() + t * d.z())) <= slack)) {
        continue;
      }
      const auto level = static_cast<std::uint8_t>(std::lround(cover * kMostCover));
      if (level > 0 && (cover_[at] & 63U) <= level) {
        // Of lines that cover alike, the kind with the higher number.
        const auto value = static_cast<std::uint8_t>(line.kind << 6U | level);
        cover_[at] = (cover_[at] & 63U) < level ? value : std::max(cover_[at], value);
      }
    }
  }
}

void LineLayer::apply(SampleGrid& grid, std::size_t look) const {
  const auto looks = static_cast<std::size_t>(grid.looks);
  parallel_indices(cover_.size(), [&](std::size_t at) {
    const LineStyle& style = styles_[cover_[at] >> 6U];
    const float amount = style.opacity * static_cast<float>(cover_[at] & 63U) / kMostCover;
    if (amount > 0.0F) {
      Rgb& colour = grid.colours[at * looks + look];
      colour = mix(colour, style.colour, amount);
    }
  });
}

}  // namespace rattan
