// SPDX-License-Identifier: MIT
#pragma once

// Which of a few numbers equal one: without a branch a number, of which a fan of triangles, in no
// order, would mispredict one in three.

#include <array>
#include <cstdint>
#include <emmintrin.h>

namespace rattan {

/// As many as most fans have triangles.
inline constexpr std::uint32_t kMostLanes = 16;
using Lanes = std::array<std::uint32_t, kMostLanes>;

/// Bit k is set if values[k] == wanted, for k < count <= kMostLanes.
inline std::uint32_t equal_lanes(const Lanes& values, std::uint32_t count, std::uint32_t wanted) {
  const __m128i w = _mm_set1_epi32(static_cast<int>(wanted));
  std::uint32_t equal = 0;
  for (std::uint32_t k = 0; k < count; k += 4) {
    const __m128i v = _mm_loadu_si128(reinterpret_cast<const __m128i*>(values.data() + k));
    const int four = _mm_movemask_ps(_mm_castsi128_ps(_mm_cmpeq_epi32(v, w)));
    equal |= static_cast<std::uint32_t>(four) << k;
  }
  return equal & ((1U << count) - 1U);
}

}  // namespace rattan
