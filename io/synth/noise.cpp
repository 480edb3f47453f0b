// SPDX-License-Identifier: MIT
#include "io/synth/noise.h"

#include <algorithm>
#include <cmath>

// Based on: K. Perlin, "Improving noise", 2002 (lattice gradients and the quintic fade), with an
// integer hash in place of the permutation table.

namespace rattan::synth {
namespace {

constexpr double kGradient[16][3] = {
    {1, 1, 0}, {-1, 1, 0}, {1, -1, 0}, {-1, -1, 0}, {1, 0, 1}, {-1, 0, 1}, {1, 0, -1}, {-1, 0, -1},
    {0, 1, 1}, {0, -1, 1}, {0, 1, -1}, {0, -1, -1}, {1, 1, 0}, {-1, 1, 0}, {0, -1, 1}, {0, -1, -1}};

constexpr int kMaxOctaves = 8;
constexpr double kFirstAmplitude = 0.09;
constexpr double kGain = 0.43;
constexpr double kRidgeAmplitude = 0.22;
constexpr double kTerraceAmplitude = 0.03;

std::int32_t floor_of(double x) {
  const std::int32_t i = static_cast<std::int32_t>(x);
  return i - static_cast<std::int32_t>(x < i);
}

double fade(double t) {
  return t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
}

double corner(std::uint32_t h, double x, double y, double z) {
  h ^= h >> 15;
  h *= 0x2c1b3c6dU;
  h ^= h >> 12;
  h *= 0x297a2d39U;
  const double* g = kGradient[h >> 28];
  return g[0] * x + g[1] * y + g[2] * z;
}

}  // namespace

double gradient_noise(const Vec3d& p, std::uint32_t seed) {
  const std::int32_t i = floor_of(p.x());
  const std::int32_t j = floor_of(p.y());
  const std::int32_t k = floor_of(p.z());
  const double x = p.x() - i;
  const double y = p.y() - j;
  const double z = p.z() - k;
  const std::uint32_t hx[2] = {static_cast<std::uint32_t>(i) * 0x9e3779b1U + seed,
                               static_cast<std::uint32_t>(i + 1) * 0x9e3779b1U + seed};
  const std::uint32_t hy[2] = {static_cast<std::uint32_t>(j) * 0x85ebca77U,
                               static_cast<std::uint32_t>(j + 1) * 0x85ebca77U};
  const std::uint32_t hz[2] = {static_cast<std::uint32_t>(k) * 0xc2b2ae3dU,
                               static_cast<std::uint32_t>(k + 1) * 0xc2b2ae3dU};
  const double u = fade(x);
  const double v = fade(y);
  const double w = fade(z);
  const auto along_x = [&](int b, int c) {
    const double left = corner(hx[0] ^ hy[b] ^ hz[c], x, y - b, z - c);
    const double right = corner(hx[1] ^ hy[b] ^ hz[c], x - 1.0, y - b, z - c);
    return left + u * (right - left);
  };
  const double low0 = along_x(0, 0);
  const double low = low0 + v * (along_x(1, 0) - low0);
  const double high0 = along_x(0, 1);
  const double high = high0 + v * (along_x(1, 1) - high0);
  return low + w * (high - low);
}

Relief::Relief(std::uint64_t seed, double finest) : seed_(static_cast<std::uint32_t>(mix(seed))) {
  for (double wavelength = 0.5; wavelength >= finest && octaves_ < kMaxOctaves; wavelength *= 0.5) {
    ++octaves_;
  }
}

double Relief::operator()(const Vec3d& p) const {
  double height = 0.0;
  double amplitude = kFirstAmplitude;
  Vec3d q = p + Vec3d(17.3, 5.1, 29.7);
  for (int k = 0; k < octaves_; ++k) {
    height += amplitude * gradient_noise(q, seed_ + static_cast<std::uint32_t>(k));
    amplitude *= kGain;
    q = q * 2.0 + Vec3d(0.37, 0.11, 0.71);  // shifted, or the octaves' zeros would coincide
  }
  // Creases: a valley where noise changes sign, and plateaus cut off at a level.
  const double ridge = gradient_noise(p * 1.3 + Vec3d(3.7, 8.2, 1.4), seed_ + 101U);
  const double terrace = gradient_noise(p * 1.7 + Vec3d(9.1, 2.6, 6.5), seed_ + 202U);
  return height + kRidgeAmplitude * std::abs(ridge) +
         kTerraceAmplitude * std::clamp(6.0 * terrace, -1.0, 1.0);
}

}  // namespace rattan::synth
