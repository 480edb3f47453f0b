// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include "engine/mesh/scan_sink.h"

namespace rattan::layout {

/// The colour `share` of the way from a to b.
inline Rgba blend(const Rgba& a, const Rgba& b, double share) {
  Rgba c{};
  for (std::size_t i = 0; i < c.size(); ++i) {
    c[i] = static_cast<std::uint8_t>(std::floor(a[i] + share * (b[i] - a[i]) + 0.5));
  }
  return c;
}

}  // namespace rattan::layout
