// SPDX-License-Identifier: MIT
#include <bit>
#include <cmath>

#include <Eigen/Geometry>

#include "engine/core/parallel.h"
#include "io/picture/samples.h"

namespace rattan {
namespace {

constexpr int kAmbientRays = 16;
constexpr int kKeyRays = 6;
constexpr std::uint32_t kAmbientMask = (1U << kAmbientRays) - 1U;
/// Pixels share a pattern of 4 x 4 rotations, which a window of 5 x 5 averages out.
constexpr int kPattern = 4;
constexpr int kWindow = 2;
constexpr std::size_t kRows = 4;
constexpr float kPi = 3.14159265F;

struct Frame {
  Vec3f a, b;
  explicit Frame(const Vec3f& n) {
    a = (std::abs(n.x()) > 0.6F ? Vec3f(0, 1, 0) : Vec3f(1, 0, 0)).cross(n).normalized();
    b = n.cross(a);
  }
};

/// Cosine-weighted about n.
Vec3f ambient_direction(const Vec3f& n, const Frame& frame, int i, float turn) {
  const float golden = 2.39996323F;
  const float r2 = (static_cast<float>(i) + 0.5F) / kAmbientRays;
  const float angle = golden * static_cast<float>(i) + turn;
  const float r = std::sqrt(r2);
  return r * std::cos(angle) * frame.a + r * std::sin(angle) * frame.b + std::sqrt(1.0F - r2) * n;
}

/// In a cone about the key light, for a soft shadow.
Vec3f key_direction(int i, float turn) {
  const Vec3f l = key_light();
  const Frame frame(l);
  const float r = 0.16F * std::sqrt((static_cast<float>(i) + 0.5F) / kKeyRays);
  const float angle = 2.39996323F * static_cast<float>(i) + turn;
  return (l + r * std::cos(angle) * frame.a + r * std::sin(angle) * frame.b).normalized();
}

}  // namespace

Vec3f key_light() {
  return Vec3f(-0.50F, 0.62F, -0.60F).normalized();
}

Occlusion::Occlusion(const SampleGrid& grid, const Camera& camera, float reach)
    : width_(grid.width), height_(grid.height), reach_(reach) {
  const std::size_t pixels = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  origin_.assign(pixels, Vec3f::Zero());
  normal_.assign(pixels, Vec3f::Zero());
  stopped_.assign(pixels, 0);
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const std::size_t sample = grid.middle(x, y);
      const float z = grid.depth[sample];
      if (!std::isfinite(z)) {
        continue;
      }
      const std::size_t pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                                static_cast<std::size_t>(x);
      const int middle_sample = grid.samples / 2;
      const float centre =
          (static_cast<float>(middle_sample) + 0.5F) / static_cast<float>(grid.samples);
      const Vec3f n = grid.normal(sample);
      normal_[pixel] = n;
      const Vec3f on =
          z * camera.ray(static_cast<float>(x) + centre, static_cast<float>(y) + centre);
      origin_[pixel] = on + 4e-3F * reach * n - 2e-3F * reach * on.normalized();
    }
  }
}

void Occlusion::add(const PartScene& part) {
  const Vec3f low = part.low();
  const Vec3f high = part.high();
  parallel_indices(
      static_cast<std::size_t>(height_),
      [&](std::size_t y) {
        for (std::size_t x = 0; x < static_cast<std::size_t>(width_); ++x) {
          const std::size_t pixel = y * static_cast<std::size_t>(width_) + x;
          const Vec3f& p = origin_[pixel];
          if (p.z() == 0.0F) {
            continue;
          }
          const float turn = 2.0F * kPi / (kPattern * kPattern) *
                             static_cast<float>((x % kPattern) * kPattern + (y * 5) % kPattern);
          std::uint32_t stopped = stopped_[pixel];
          const Vec3f& n = normal_[pixel];
          const Vec3f gap = (low - p).cwiseMax(p - high).cwiseMax(Vec3f::Zero());
          if (gap.squaredNorm() < reach_ * reach_) {
            const Frame frame(n);
            for (int i = 0; i < kAmbientRays; ++i) {
              const std::uint32_t bit = 1U << i;
              if ((stopped & bit) == 0 &&
                  part.occluded(p, ambient_direction(n, frame, i, turn), reach_)) {
                stopped |= bit;
              }
            }
          }
          if (n.dot(key_light()) > 0.0F) {
            for (int i = 0; i < kKeyRays; ++i) {
              const std::uint32_t bit = 1U << (kAmbientRays + i);
              if ((stopped & bit) == 0 && part.occluded(p, key_direction(i, turn),
                                                        std::numeric_limits<float>::infinity())) {
                stopped |= bit;
              }
            }
          }
          stopped_[pixel] = stopped;
        }
      },
      kRows);
}

Occlusion::Light Occlusion::at(const SampleGrid& grid, std::size_t sample, int x, int y) const {
  const float z = grid.depth[sample];
  const Vec3f n = grid.normal(sample);
  float weight = 0.0F;
  float ambient = 0.0F;
  float key = 0.0F;
  for (int j = std::max(0, y - kWindow); j <= std::min(height_ - 1, y + kWindow); ++j) {
    for (int i = std::max(0, x - kWindow); i <= std::min(width_ - 1, x + kWindow); ++i) {
      const std::size_t pixel = static_cast<std::size_t>(j) * static_cast<std::size_t>(width_) +
                                static_cast<std::size_t>(i);
      if (origin_[pixel].z() == 0.0F) {
        continue;
      }
      const float facing = std::max(0.0F, n.dot(normal_[pixel]));
      const float step = (origin_[pixel].z() - z) / (0.1F * reach_);
      const float w = facing * facing * facing * facing / (1.0F + step * step) + 1e-5F;
      weight += w;
      ambient += w * static_cast<float>(std::popcount(stopped_[pixel] & kAmbientMask));
      key += w * static_cast<float>(std::popcount(stopped_[pixel] & ~kAmbientMask));
    }
  }
  if (!(weight > 0.0F)) {
    return {};
  }
  return {1.0F - ambient / (weight * kAmbientRays), 1.0F - key / (weight * kKeyRays)};
}

}  // namespace rattan
