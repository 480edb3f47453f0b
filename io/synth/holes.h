// SPDX-License-Identifier: MIT
#pragma once

// Which quads of the patches are missing; internal to io/synth. A hole is one run of quads a row,
// with a column that all its rows share: a disk without pinched vertices, whatever its edge. Holes
// share no vertex.

#include <array>
#include <cstdint>
#include <vector>

#include "io/synth/patches.h"

namespace rattan::synth {

struct Hole {
  std::uint32_t first_row = 0;
  std::vector<std::array<std::uint32_t, 2>> runs;  ///< first and last quad of each row
};

class Holes {
 public:
  /// Throws UsageError if so many holes do not fit.
  Holes(const PatchComplex& complex, std::uint64_t count, std::uint64_t seed);

  /// Marks the missing quads of a row of the patch with 1; false (and nothing written) if there are
  /// none. `row` may be one past either end, given as an unsigned number.
  bool mark(std::uint32_t patch, std::uint32_t row, std::vector<std::uint8_t>& missing) const;
  bool any(std::uint32_t patch) const { return !of_patch_[patch].empty(); }
  std::uint64_t missing_quads() const { return missing_quads_; }
  /// Vertices all of whose quads are missing.
  std::uint64_t missing_vertices() const { return missing_vertices_; }

 private:
  void add(std::uint32_t patch, Hole hole);

  std::vector<std::vector<Hole>> of_patch_;
  std::uint64_t missing_quads_ = 0;
  std::uint64_t missing_vertices_ = 0;
};

}  // namespace rattan::synth
