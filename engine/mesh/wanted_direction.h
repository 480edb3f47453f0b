// SPDX-License-Identifier: MIT
#pragma once

// Directions that come with a scan, for its field to follow.

#include "engine/core/store.h"
#include "engine/core/types.h"

namespace rattan {

/// What a vertex' direction in the field should be: a vector of any length, zero for no opinion,
/// and its fidelity in [0, 1], the weight of PGP 4.2.
struct VertexDirection {
  Vec3f direction{0.0F, 0.0F, 0.0F};
  float fidelity = 1.0F;
};

namespace fields {
/// One an owned vertex; only where the scan came with directions.
inline constexpr Field<VertexDirection> kWantedDirection{"mesh/direction"};
}  // namespace fields

inline bool has_wanted_directions(const Store& store) {
  return store.has_chunk(fields::kWantedDirection.name, TileId(0));
}

}  // namespace rattan
