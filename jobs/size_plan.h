// SPDX-License-Identifier: MIT
#pragma once

// Which of several sizes share a parameterization: its iso-lines can be drawn at any integer
// multiple of their density (PGP Figures 14 and 15).

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace rattan {

struct PlannedSize {
  std::size_t size = 0;  ///< its place among the sizes asked for
  /// Place of the coarser size whose parameterization serves this one, and lines for each of its
  /// lines; without value and 1 if it has a solve of its own.
  std::optional<std::size_t> owner;
  int multiple = 1;
};

/// In the order of making: each size right after its owner and the others of that owner. A finer
/// size shares if its faces are within 15 % of an integer's square times those of a coarser one and
/// `density` (lines per period) times that integer is at most four: more lines bend with the coarse
/// parameterization's relief. `faces`: the sizes asked for, positive.
std::vector<PlannedSize> plan_sizes(std::span<const double> faces, int density);

}  // namespace rattan
