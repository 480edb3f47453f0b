// SPDX-License-Identifier: MIT
// Based on: C. Hamilton, "Compact Hilbert Indices" (2006): the curve's state is the corner at which
// a cell is entered and the axis along which it is left; both follow from tables, here joined to
// one.
#include "engine/mesh/curve.h"

#include <algorithm>
#include <array>

namespace rattan {

namespace {

struct Step {
  std::uint8_t digit;
  std::uint8_t next;
};

constexpr std::uint32_t rotate_left(std::uint32_t v, std::uint32_t by) {
  by %= 3;
  return ((v << by) | (v >> (3 - by))) & 7U;
}

constexpr std::uint32_t rotate_right(std::uint32_t v, std::uint32_t by) {
  by %= 3;
  return ((v >> by) | (v << (3 - by))) & 7U;
}

constexpr std::uint32_t gray(std::uint32_t i) {
  return i ^ (i >> 1);
}

constexpr std::uint32_t trailing_set_bits(std::uint32_t i) {
  std::uint32_t n = 0;
  while ((i & 1U) != 0U) {
    i >>= 1;
    ++n;
  }
  return n;
}

/// State = 8 * axis + entry corner; 8 octants each.
constexpr std::array<Step, 24 * 8> make_steps() {
  std::array<Step, 24 * 8> steps{};
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    for (std::uint32_t entry = 0; entry < 8; ++entry) {
      for (std::uint32_t octant = 0; octant < 8; ++octant) {
        const std::uint32_t turned = rotate_right(octant ^ entry, axis + 1);
        std::uint32_t w = 0;
        while (gray(w) != turned) {
          ++w;
        }
        const std::uint32_t into = w == 0 ? 0 : gray(2 * ((w - 1) / 2));
        const std::uint32_t along = w == 0 ? 0 : trailing_set_bits(w % 2 == 0 ? w - 1 : w) % 3;
        const std::uint32_t next_entry = entry ^ rotate_left(into, axis + 1);
        const std::uint32_t next_axis = (axis + along + 1) % 3;
        steps[(axis * 8 + entry) * 8 + octant] = {
            static_cast<std::uint8_t>(w), static_cast<std::uint8_t>(next_axis * 8 + next_entry)};
      }
    }
  }
  return steps;
}

constexpr std::array<Step, 24 * 8> kSteps = make_steps();

}  // namespace

std::uint64_t hilbert_index(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  std::uint64_t index = 0;
  std::uint32_t state = 0;
  for (int bit = kCurveBits - 1; bit >= 0; --bit) {
    const std::uint32_t octant =
        ((x >> bit) & 1U) | (((y >> bit) & 1U) << 1) | (((z >> bit) & 1U) << 2);
    const Step step = kSteps[state * 8 + octant];
    index = index << 3 | step.digit;
    state = step.next;
  }
  return index;
}

HilbertCurve::HilbertCurve(const Vec3d& box_min, const Vec3d& box_max) : box_min_(box_min) {
  const double side = (box_max - box_min).maxCoeff();
  scale_ = side > 1e-300 ? static_cast<double>(1U << kCurveBits) / side : 0.0;
}

std::uint64_t HilbertCurve::operator()(const Vec3d& p) const {
  constexpr double kLast = static_cast<double>((1U << kCurveBits) - 1);
  const auto cell = [&](int axis) {
    return static_cast<std::uint32_t>(std::clamp((p[axis] - box_min_[axis]) * scale_, 0.0, kLast));
  };
  return hilbert_index(cell(0), cell(1), cell(2));
}

}  // namespace rattan
