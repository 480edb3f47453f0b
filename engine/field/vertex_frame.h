// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "engine/core/store.h"
#include "engine/core/types.h"

namespace rattan {

/// A vertex of the low-passed surface with its control vectors.
struct VertexFrame {
  Vec3f position{0.0F, 0.0F, 0.0F};   ///< low-passed, relative to the scan's origin
  Vec3f normal{0.0F, 0.0F, 1.0F};     ///< unit
  Vec3f direction{1.0F, 0.0F, 0.0F};  ///< unit tangent K; K_perp = normal x direction
  float scale = 1.0F;                 ///< v of curl correction; 1 without
  /// On a feature curve: which coordinate is constant along it and has to be a line, kPinTheta if
  /// K_perp follows the curve, kPinPhi if K does; both at corners, where K means nothing.
  std::uint32_t pins = 0;
};

inline constexpr std::uint32_t kPinTheta = 1;
inline constexpr std::uint32_t kPinPhi = 2;
inline constexpr std::uint32_t kPinBoth = 3;

namespace fields {
/// The finished field, with its halo board.
inline constexpr Field<VertexFrame> kFrame{"field/frame"};
}  // namespace fields

}  // namespace rattan
