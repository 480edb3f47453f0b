// SPDX-License-Identifier: MIT
#pragma once

// What the rays of a picture found, and how light falls on it.

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "io/picture/part_scene.h"

namespace rattan {

/// Camera space; toward the light.
Vec3f key_light();

/// Nearest hits, `samples` x `samples` a pixel; row after row of the fine grid.
struct SampleGrid {
  int width = 0, height = 0;  ///< pixels
  int samples = 1;
  int looks = 1;
  std::vector<float> depth;                          ///< infinity where nothing was hit
  std::vector<std::array<std::int16_t, 3>> normals;  ///< camera space, toward the eye, / 32767
  std::vector<Rgb> colours;                          ///< looks a sample: albedo with its drawing
  /// Where the surface turns its back to the eye; may be empty.
  std::vector<std::uint8_t> inside;
  /// Of each pixel's middle sample, where the surface has a field: tangent, camera space.
  std::vector<Vec3f> directions;
  std::vector<Vec3f> raw_directions;  ///< likewise, of the field before it was smoothed

  SampleGrid(int w, int h, int s, int l, bool with_directions, bool with_raw)
      : width(w), height(h), samples(s), looks(l) {
    const std::size_t n = fine_width() * static_cast<std::size_t>(h) * static_cast<std::size_t>(s);
    depth.assign(n, std::numeric_limits<float>::infinity());
    normals.resize(n);
    colours.resize(n * static_cast<std::size_t>(l));
    const std::size_t pixels = static_cast<std::size_t>(w) * static_cast<std::size_t>(h);
    directions.assign(with_directions ? pixels : 0, Vec3f::Zero());
    raw_directions.assign(with_raw ? pixels : 0, Vec3f::Zero());
  }
  std::size_t fine_width() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(samples);
  }
  /// Middle sample of a pixel.
  std::size_t middle(int x, int y) const {
    const auto s = static_cast<std::size_t>(samples);
    return (static_cast<std::size_t>(y) * s + s / 2) * fine_width() +
           static_cast<std::size_t>(x) * s + s / 2;
  }
  Vec3f normal(std::size_t sample) const {
    const auto& n = normals[sample];
    return Vec3f(n[0], n[1], n[2]) * (1.0F / 32767.0F);
  }
};

/// Ambient occlusion and the key light's shadow, a set of rays a pixel. Each part of the surface
/// adds the rays it stops, so the parts need not be in memory together.
class Occlusion {
 public:
  /// `reach`: how far ambient rays look, camera-space length.
  Occlusion(const SampleGrid& grid, const Camera& camera, float reach);
  void add(const PartScene& part);

  struct Light {
    float ambient = 1.0F;  ///< 0 to 1, the share of rays that get away
    float key = 1.0F;
  };
  /// Of one sample: the mean over the surrounding pixels that lie on the same piece of surface.
  /// Depths this near to each other are on the same piece of surface.
  float nearby() const { return 0.03F * reach_; }
  Light at(const SampleGrid& grid, std::size_t sample, int x, int y) const;

 private:
  int width_, height_;
  float reach_;
  std::vector<Vec3f> origin_;  // pixels without surface have z = 0
  std::vector<Vec3f> normal_;
  std::vector<std::uint32_t> stopped_;  // a bit a ray
};

}  // namespace rattan
