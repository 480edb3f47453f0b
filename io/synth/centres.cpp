// SPDX-License-Identifier: MIT
#include "io/synth/centres.h"

#include <algorithm>
#include <cmath>

namespace rattan::synth {
namespace {

// Below this many quads the count is met exactly, by bisection.
constexpr std::uint64_t kExactQuads = 200000;

}  // namespace

Centres::Centres(const PatchComplex& complex, const Holes& holes, std::uint64_t wanted,
                 std::uint64_t seed)
    : complex_(complex), seed_(seed) {
  const std::uint64_t quads = complex.quads() - holes.missing_quads();
  if (wanted == 0) {
    return;
  }
  if (quads <= kExactQuads) {
    double low = 0.0;
    double high = 16.0;  // beyond it every quad has one
    for (int step = 0; step < 48; ++step) {
      const double middle = 0.5 * (low + high);
      density_ = middle;
      count_ = count_at(middle, holes);
      if (count_ == wanted) {
        return;
      }
      (count_ < wanted ? low : high) = middle;
    }
    return;
  }
  density_ = static_cast<double>(wanted) / static_cast<double>(quads);
  for (int step = 0; step < 3; ++step) {
    count_ = count_at(density_, holes);
    const double ratio =
        static_cast<double>(wanted) / static_cast<double>(std::max<std::uint64_t>(count_, 1));
    if (step == 2 || std::abs(ratio - 1.0) < 0.01) {
      return;
    }
    density_ *= ratio;
  }
}

void Centres::Row::begin(const Centres& centres, std::uint32_t patch, std::uint32_t row) {
  const Patch& p = centres.complex_.patches[patch];
  key_ = hash(centres.seed_, 11, patch, row);
  if (row % kBlock != 0 && !threshold_.empty()) {
    return;
  }
  threshold_.clear();
  for (std::uint32_t i = 0; i < p.nu; i += kBlock) {
    const Vec3d at =
        p.evaluate(static_cast<double>(i) / p.nu, static_cast<double>(row) / p.nv).position;
    const double uneven =
        1.0 + 1.6 * gradient_noise(at * 1.5 + Vec3d(2.2, 4.4, 6.6),
                                   static_cast<std::uint32_t>(centres.seed_ >> 16));
    const double share = std::clamp(centres.density_ * std::clamp(uneven, 0.1, 2.0), 0.0, 1.0);
    threshold_.push_back(static_cast<std::uint64_t>(share * 4294967296.0));
  }
}

std::uint64_t Centres::count_at(double density, const Holes& holes) const {
  Centres trial = *this;
  trial.density_ = density;
  std::uint64_t count = 0;
  std::vector<std::uint8_t> missing;
  for (std::uint32_t p = 0; p < complex_.patches.size(); ++p) {
    const Patch& patch = complex_.patches[p];
    missing.assign(patch.nu, 0);
    Row row;
    for (std::uint32_t j = 0; j < patch.nv; ++j) {
      row.begin(trial, p, j);
      const bool has_missing = holes.mark(p, j, missing);
      for (std::uint32_t i = 0; i < patch.nu; ++i) {
        count += static_cast<std::uint64_t>(row(i) && !(has_missing && missing[i] != 0));
      }
    }
  }
  return count;
}

}  // namespace rattan::synth
