// SPDX-License-Identifier: MIT
#pragma once

// Which quads get a vertex in their middle and so four triangles instead of two: at random, more in
// some regions than in others, as many as the wanted count needs; internal to io/synth.

#include <cstdint>
#include <vector>

#include "io/synth/holes.h"
#include "io/synth/noise.h"
#include "io/synth/patches.h"

namespace rattan::synth {

class Centres {
 public:
  /// Chooses the density so that count() is `wanted` or near it; counts quads a few times over.
  Centres(const PatchComplex& complex, const Holes& holes, std::uint64_t wanted,
          std::uint64_t seed);

  std::uint64_t count() const { return count_; }

  /// The choice in one row of quads; rows of a patch must come in order from the first.
  class Row {
   public:
    void begin(const Centres& centres, std::uint32_t patch, std::uint32_t row);
    bool operator()(std::uint32_t i) const {
      return (mix(key_ + i) >> 32) < threshold_[i / kBlock];
    }

   private:
    std::uint64_t key_ = 0;
    std::vector<std::uint64_t> threshold_;  // of 2^32, per block of quads
  };

 private:
  static constexpr std::uint32_t kBlock = 16;
  std::uint64_t count_at(double density, const Holes& holes) const;

  const PatchComplex& complex_;
  std::uint64_t seed_;
  double density_ = 0.0;
  std::uint64_t count_ = 0;
};

}  // namespace rattan::synth
