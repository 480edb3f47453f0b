// SPDX-License-Identifier: MIT
#pragma once

// What parameterization leaves in the store and extraction starts from, beside fields::kFrame
// (engine/field/vertex_frame.h). One chunk a tile over owned
// vertices; each field's halo board is stored too (read_local in tile_layout.h puts both together).

#include "engine/param/edge_gauge.h"
#include "engine/solve/system.h"

namespace rattan::fields {

inline constexpr Field<PairValue> kPhase{"param/phase"};

}  // namespace rattan::fields
