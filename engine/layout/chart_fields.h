// SPDX-License-Identifier: MIT
#pragma once

// What the layout says about the scan's own triangles.

#include "engine/core/store.h"
#include "engine/layout/chart_graph.h"

namespace rattan::fields {

/// The chart that holds most of the triangle's area, kNoChart for none; one an owned triangle.
inline constexpr Field<std::uint32_t> kTriangleChart{"layout/triangle_chart"};

}  // namespace rattan::fields
