// SPDX-License-Identifier: MIT
#pragma once

#include "engine/layout/stitch.h"

namespace rattan::layout {

/// Scanned boundaries zigzag from vertex to vertex; a corner is one at the scale of the cells too.
/// Clears kCornerNode elsewhere; needs the strands between all candidates. True if some nodes are
/// essential no more.
bool keep_true_corners(Skeleton& skeleton, const TraceOptions& options);

}  // namespace rattan::layout
