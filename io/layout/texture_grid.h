// SPDX-License-Identifier: MIT
#pragma once

// The grid that texture coordinates are rounded to in a Draco file; internal to io/layout.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/types.h"

namespace rattan {

/// Multiples of 2^-fraction_bits from `low` on. A power of two, so that whole numbers, their halves
/// and so on are on the grid, and quarter turns and translations between parts map it onto itself.
struct TextureGrid {
  bool quantised = false;  ///< else texture coordinates stay float32
  int fraction_bits = 0;
  int bits = 0;           ///< of Draco's quantiser, for the whole range
  std::int32_t low[2]{};  ///< whole
  std::uint64_t folded =
      0;  ///< triangles that are not counter-clockwise on the grid (or as floats)

  double step() const;
  /// What Draco must be told: step times the largest number of `bits` bits; a float32 holds it.
  double range() const;
  std::array<float, 2> round(const Vec2d& uv) const;
};

inline constexpr int kLeastFractionBits = 12;
/// Draco's quantiser adds one half in float32, which is exact up to here.
inline constexpr std::uint64_t kMostTextureSteps = std::uint64_t{1} << 23;

/// The coarsest grid from `least_bits` on where every triangle is counter-clockwise, judged in
/// integers; float32 where there is none. If that folds triangles too, whatever folds the
/// fewest. Rounding is half to even, so x and n - x, for even n, are rounded alike. Pre: finite
/// coordinates.
TextureGrid choose_texture_grid(std::span<const Vec2d> uv,
                                std::span<const std::array<std::uint32_t, 3>> triangles,
                                int least_bits = kLeastFractionBits);

}  // namespace rattan
