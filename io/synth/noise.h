// SPDX-License-Identifier: MIT
#pragma once

// Seeded randomness without a state: integer hashes, and gradient noise over space; internal to
// io/synth. Only exactly defined arithmetic, so the values are the same on any machine.

#include <cstdint>

#include "engine/core/types.h"

namespace rattan::synth {

/// A bijection that scatters all bits (the finaliser of SplitMix64).
inline std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15U;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9U;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebU;
  return x ^ (x >> 31);
}

inline std::uint64_t hash(std::uint64_t seed, std::uint64_t a, std::uint64_t b = 0,
                          std::uint64_t c = 0) {
  return mix(seed ^ (a * 0xd6e8feb86659fd93U) ^ (b * 0xa0761d6478bd642fU) ^
             (c * 0xe7037ed1a0b428dbU));
}

/// In [0, 1), from 32 bits of a hash.
inline double unit(std::uint64_t bits) {
  return static_cast<double>(bits & 0xffffffffU) * (1.0 / 4294967296.0);
}

/// Gradient noise with features of size 1, about within [-0.8, 0.8], zero on average.
double gradient_noise(const Vec3d& p, std::uint32_t seed);

/// Height of the relief over a point of the base shape.
class Relief {
 public:
  /// Octaves finer than `finest` (a length) are left out: they would only alias.
  Relief(std::uint64_t seed, double finest);
  double operator()(const Vec3d& p) const;

 private:
  std::uint32_t seed_;
  int octaves_ = 1;
};

}  // namespace rattan::synth
