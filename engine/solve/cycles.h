// SPDX-License-Identifier: MIT
#pragma once

// Real systems in a fixed number of passes over the finest level. Two levels below it conjugate
// gradients are cheap; from there the answer is carried up, relaxed, and corrected by what the
// levels below make of its residual.

#include "engine/solve/passes.h"

namespace rattan {

/// 1 + 2 options.cycles passes over the finest level; one if that is the coarsest, too, and then
/// neither hooks nor evaluation are served. Needs a right-hand side, and a fit on every component.
template <class Block>
void solve_in_cycles(SystemHierarchy<Block>& system, const SolveOptions& options,
                     SolveHooks<Block>* hooks, Evaluation* evaluation, SolveReport& report,
                     TaskGraph& tasks);

}  // namespace rattan
