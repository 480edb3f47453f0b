// SPDX-License-Identifier: MIT
#pragma once

// The last level of a scan of one tile: several answers of the coarser level are carried on to the
// finest, and the one that ends lowest stays.

#include <vector>

#include "engine/solve/passes.h"

namespace rattan {

/// Relaxes each candidate (values of the one coarse tile) on the finest tile as `plan` says
/// (kProlong; its passes together), and writes the one of least energy at unit norms, the first of
/// equals. One pass over a level of one tile; memory: one solution a candidate.
template <class Block>
void relax_best(SystemLevel<Block>& fine, const std::vector<std::vector<Value<Block>>>& candidates,
                const SmoothPlan<Block>& plan, TaskGraph& tasks);

}  // namespace rattan
