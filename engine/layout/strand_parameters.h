// SPDX-License-Identifier: MIT
#pragma once

// The one parameterization of a strand that both of its charts use.

#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/types.h"

namespace rattan::layout {

/// Coordinates along chart sides are multiples of this part of a unit: exact in single precision,
/// and so is `units` minus them, what the chart beyond the strand has.
inline constexpr double kRimGrid = 1.0 / 65536;
/// Neighbours on a strand are so many units apart, at least; half an even share where there are
/// too many of them for that.
inline constexpr double kLeastGap = 1.0 / 512;
/// Likewise on the geodesics that split a chart, which often pass through bundles of thin
/// triangles.
inline constexpr double kLeastSpokeGap = 1.0 / 64;

struct StrandPoint {
  double at = 0;            ///< in units from the strand's start
  std::uint32_t point = 0;  ///< of those given; of a new one the last one before it
  double share = 0;         ///< of a new one: how far from that point to the next, in (0, 1)
  bool made = false;        ///< a new one
  bool division = false;    ///< at a whole number of units; the strand's ends are too
};

/// `position`: the strand's points in the direction of dart 2 s; closed strands have their start at
/// either end. `step`: one fewer, as ChartMesh::step. Returns them and the divisions that no point
/// lies near enough to serve as, in order; `at` from 0 to parts * units, growing strictly. By the
/// steps where these cover one period or one a part, else by arc length. `given`: values of `at` to
/// take instead, as an earlier call returned them or moved between divisions; empty otherwise.
/// Throws InternalError if a unit has more points than kRimGrid can tell apart.
std::vector<StrandPoint> strand_parameters(std::span<const Vec3d> position,
                                           std::span<const double> step, std::uint32_t parts,
                                           std::uint32_t units, std::span<const double> given = {},
                                           double least_gap = kLeastGap);

/// Rounds `at` to the grid and keeps the least gap, or half an even share, moving points as little
/// as that takes; divisions stay.
void keep_gaps(std::span<StrandPoint> points, double least_gap = kLeastGap);

}  // namespace rattan::layout
