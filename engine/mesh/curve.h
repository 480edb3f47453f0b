// SPDX-License-Identifier: MIT
#pragma once

// The space-filling curve that orders a scan's vertices.

#include <cstdint>

#include "engine/core/types.h"

namespace rattan {

inline constexpr int kCurveBits = 21;  ///< per axis

/// Index along the Hilbert curve of order kCurveBits of a cell, each coordinate in [0, 2^21). Cells
/// of successive indices share a face.
std::uint64_t hilbert_index(std::uint32_t x, std::uint32_t y, std::uint32_t z);

/// Maps points of a box to curve indices; the grid is a cube over the longest side.
class HilbertCurve {
 public:
  HilbertCurve(const Vec3d& box_min, const Vec3d& box_max);
  /// Points outside the box are clamped to it. Pre: finite.
  std::uint64_t operator()(const Vec3d& p) const;

 private:
  Vec3d box_min_;
  double scale_;
};

}  // namespace rattan
