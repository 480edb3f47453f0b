// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "engine/core/types.h"

namespace rattan {

/// What travels with a remesh beside its geometry. Strings may be empty; `.drc` keeps them in its
/// metadata, `.obj`, `.ply` and `.off` in comments (which read_polygons does not parse).
struct RemeshMetadata {
  std::string version;     ///< of Rattan, e.g. "0.1.0"
  std::string options;     ///< the command's options as a string
  std::string input_hash;  ///< SHA-256 of the scan, hexadecimal
  /// Add to every position for the scan's own coordinates.
  Vec3d origin{0.0, 0.0, 0.0};
};

}  // namespace rattan
