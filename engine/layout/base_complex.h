// SPDX-License-Identifier: MIT
#pragma once

// The base complex of a layout (PGP Fig. 1 F): the quadrilaterals of the parameterization as a mesh
// of their own.

#include "engine/layout/flat_layout.h"
#include "engine/remesh/polygon_mesh.h"

namespace rattan {

/// Quads only, a simple mesh (no two edges join the same vertices) with the scan's Euler
/// characteristic, components and boundary loops. With units 1 a chart is a quad; with units 2 a
/// chart of N sides is N quads around its centre. Where a chart meets itself along a strand, a ring
/// of quads keeps its two sides apart: 3 N quads instead of N. In the order of charts; positions
/// lie on the surface, save for those of such rings.
PolygonMesh base_complex(const ChartLayout& layout, const FlatLayout& flat);

}  // namespace rattan
