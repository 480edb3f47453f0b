// SPDX-License-Identifier: MIT
#pragma once

// How every solve ends, whichever way it got there.

#include "engine/solve/passes.h"

namespace rattan {

/// Sweeps at unit norm that settle a periodic solution.
inline constexpr int kUnitSweeps = 3;

/// Brings the complex parts of the finest level's stored solution to unit length and relaxes them
/// there. One pass over the tiles.
template <class Block>
void settle_at_unit_norm(SystemLevel<Block>& finest, TaskGraph& tasks);

/// Writes the solution's board to the store and, if the options ask for it, spends a pass on the
/// report's energies.
template <class Block>
void finish_solve(const SystemLevel<Block>& finest, Store& store, const SolveOptions& options,
                  SolveReport& report, TaskGraph& tasks);

}  // namespace rattan
