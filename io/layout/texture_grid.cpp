// SPDX-License-Identifier: MIT
#include "io/layout/texture_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "engine/core/errors.h"
#include "io/layout/layout_audit.h"

namespace rattan {
namespace {

/// Triangles that are not counter-clockwise once rounded to whole numbers of 2^-fraction_bits;
/// counts no further than `enough`.
std::uint64_t folded_on_grid(std::span<const Vec2d> uv,
                             std::span<const std::array<std::uint32_t, 3>> triangles,
                             int fraction_bits, std::uint64_t enough) {
  const double scale = std::ldexp(1.0, fraction_bits);
  std::uint64_t folded = 0;
  for (const auto& triangle : triangles) {
    std::int64_t x[3];
    std::int64_t y[3];
    for (std::size_t k = 0; k < 3; ++k) {
      x[k] = static_cast<std::int64_t>(std::nearbyint(uv[triangle[k]][0] * scale));
      y[k] = static_cast<std::int64_t>(std::nearbyint(uv[triangle[k]][1] * scale));
    }
    const std::int64_t area = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0]);
    if (area <= 0 && ++folded >= enough) {
      break;
    }
  }
  return folded;
}

}  // namespace

double TextureGrid::step() const {
  return quantised ? std::ldexp(1.0, -fraction_bits) : 0.0;
}

double TextureGrid::range() const {
  return std::ldexp(static_cast<double>((1 << bits) - 1), -fraction_bits);
}

std::array<float, 2> TextureGrid::round(const Vec2d& uv) const {
  if (!quantised) {
    return {static_cast<float>(uv[0]), static_cast<float>(uv[1])};
  }
  const double scale = std::ldexp(1.0, fraction_bits);
  return {static_cast<float>(std::nearbyint(uv[0] * scale) / scale),
          static_cast<float>(std::nearbyint(uv[1] * scale) / scale)};
}

TextureGrid choose_texture_grid(std::span<const Vec2d> uv,
                                std::span<const std::array<std::uint32_t, 3>> triangles,
                                int least_bits) {
  Vec2d low = Vec2d::Zero();
  Vec2d high = Vec2d::Ones();
  for (const Vec2d& p : uv) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  TextureGrid best;
  for (const auto& [a, b, c] : triangles) {
    best.folded += counter_clockwise_as_float(uv[a], uv[b], uv[c]) ? 0 : 1;
  }
  // Coordinates further out than this are no texture coordinates of a layout.
  if (low.minCoeff() < -1024.0 || high.maxCoeff() > 1024.0) {
    return best;
  }
  ensure(least_bits >= 0, "A texture grid has whole steps.");
  TextureGrid grid;
  grid.quantised = true;
  for (int k = 0; k < 2; ++k) {
    grid.low[k] = static_cast<std::int32_t>(std::floor(low[k]));
  }
  std::uint32_t extent = 1;
  for (int k = 0; k < 2; ++k) {
    extent = std::max(extent, static_cast<std::uint32_t>(std::ceil(high[k]) - grid.low[k]));
  }
  for (grid.fraction_bits = least_bits;; ++grid.fraction_bits) {
    // The upper end of the range must be on the grid too.
    const std::uint64_t largest = std::uint64_t{extent} << grid.fraction_bits;
    if (largest > kMostTextureSteps) {
      return best;
    }
    grid.bits = static_cast<int>(std::bit_width(largest));
    // A grid must fold fewer than a coarser one, and no more than float32.
    const std::uint64_t enough = best.quantised ? best.folded : best.folded + 1;
    grid.folded = folded_on_grid(uv, triangles, grid.fraction_bits, enough);
    if (grid.folded < enough) {
      best = grid;
    }
    if (best.quantised && best.folded == 0) {
      return best;
    }
  }
}

}  // namespace rattan
