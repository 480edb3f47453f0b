// SPDX-License-Identifier: MIT
#include "io/picture/texture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/core/errors.h"

namespace rattan {
namespace {

/// Mean over an interval about x of the wave that is 1 in fields of even number, -1 in others.
float wave_mean(float x, float width) {
  const float w = std::max(width, 1e-4F);
  // A triangle wave is its integral.
  const auto integral = [](float t) {
    const float half = 0.5F * t;
    return std::abs(half - std::floor(half) - 0.5F);
  };
  return 2.0F * (integral(x - 0.5F * w) - integral(x + 0.5F * w)) / w;
}

Image halved(const Image& from) {
  Image to(std::max(1, from.width() / 2), std::max(1, from.height() / 2));
  for (int y = 0; y < to.height(); ++y) {
    for (int x = 0; x < to.width(); ++x) {
      std::array<int, 3> sum{2, 2, 2};
      for (int i = 0; i < 4; ++i) {
        const Rgb& c = from.at(std::min(2 * x + i % 2, from.width() - 1),
                               std::min(2 * y + i / 2, from.height() - 1));
        for (std::size_t k = 0; k < 3; ++k) {
          sum[k] += c[k];
        }
      }
      for (std::size_t k = 0; k < 3; ++k) {
        to.at(x, y)[k] = static_cast<std::uint8_t>(sum[k] / 4);
      }
    }
  }
  return to;
}

using Colour = std::array<float, 3>;

/// Between the four nearest pixels.
Colour between(const Image& image, float u, float v) {
  const auto pixel = [](float t, int n) {
    const float at = (t - std::floor(t)) * static_cast<float>(n) - 0.5F;
    const int first = static_cast<int>(std::floor(at));
    return std::pair((first + n) % n, at - static_cast<float>(first));
  };
  const auto [x, fx] = pixel(u, image.width());
  const auto [y, fy] = pixel(1.0F - v, image.height());
  const int right = (x + 1) % image.width();
  const int below = (y + 1) % image.height();
  Colour out{};
  for (std::size_t k = 0; k < 3; ++k) {
    const float top = static_cast<float>(image.at(x, y)[k]) * (1.0F - fx) +
                      static_cast<float>(image.at(right, y)[k]) * fx;
    const float low = static_cast<float>(image.at(x, below)[k]) * (1.0F - fx) +
                      static_cast<float>(image.at(right, below)[k]) * fx;
    out[k] = top * (1.0F - fy) + low * fy;
  }
  return out;
}

}  // namespace

float light_share(float x, float y, float width, float height) {
  return 0.5F + 0.5F * wave_mean(x + 0.5F, width) * wave_mean(y + 0.5F, height);
}

PictureTexture::PictureTexture(Image picture) {
  ensure(picture.width() > 0 && picture.height() > 0, "a texture has pixels");
  levels_.push_back(std::move(picture));
  while (std::max(levels_.back().width(), levels_.back().height()) > 1) {
    levels_.push_back(halved(levels_.back()));
  }
}

Rgb PictureTexture::at(float u, float v, float extent) const {
  const auto side = static_cast<float>(std::max(levels_[0].width(), levels_[0].height()));
  const float level = std::clamp(std::log2(std::max(extent * side, 1.0F)), 0.0F,
                                 static_cast<float>(levels_.size() - 1));
  const auto fine = static_cast<std::size_t>(level);
  const float coarse_share = level - static_cast<float>(fine);
  const Colour a = between(levels_[fine], u, v);
  const Colour b = between(levels_[std::min(fine + 1, levels_.size() - 1)], u, v);
  Rgb out;
  for (std::size_t k = 0; k < 3; ++k) {
    out[k] =
        static_cast<std::uint8_t>(std::lround(a[k] * (1.0F - coarse_share) + b[k] * coarse_share));
  }
  return out;
}

}  // namespace rattan
