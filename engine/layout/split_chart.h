// SPDX-License-Identifier: MIT
#pragma once

// Charts that have not four sides are cut into as many quadrilaterals (PGP 3.4, Fig. 6 C, D): a
// centre is joined to the middle of each side by a geodesic on the surface.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/types.h"

namespace rattan {

struct SplitDisk {
  std::vector<Vec3d> position;  ///< the input's vertices, then new ones
  /// A new vertex at (1 - share) a + share b, share in (0, 1). a and b come before it.
  struct Made {
    std::uint32_t a = 0;
    std::uint32_t b = 0;
    double share = 0;
  };
  std::vector<Made> made;                              ///< one a new vertex
  std::vector<std::array<std::uint32_t, 3>> triangle;  ///< grouped by part
  /// N + 1, into triangle. Part i holds the corner between middles i - 1 and i. Its rim, counter-
  /// clockwise: from middle i - 1 along the input's rim to middle i, spoke i back to the centre,
  /// spoke i - 1 outwards.
  std::vector<std::uint32_t> part_begin;
  std::uint32_t centre = 0;
  std::vector<std::vector<std::uint32_t>> spokes;  ///< [i]: from the centre to middle i
};

/// Cuts a disk into N parts, which are disks again. The rim keeps its vertices. Spokes have no
/// vertex in common but the centre, touch the rim at their middles alone, and are no longer than
/// any way along edges that keeps off the rim and the spokes before. `triangle`: manifold,
/// consistently oriented, one boundary loop, no two edges between the same vertices; triangles may
/// have no area. `middles`: N >= 2 rim vertices in counter-clockwise order, at least one more
/// between any two. Throws InternalError if the input is otherwise.
SplitDisk split_disk(std::span<const Vec3d> position,
                     std::span<const std::array<std::uint32_t, 3>> triangle,
                     std::span<const std::uint32_t> middles);

}  // namespace rattan
