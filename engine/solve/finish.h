// SPDX-License-Identifier: MIT
#pragma once

// How every solve ends, whichever way it got there.

#include <optional>

#include "engine/solve/passes.h"

namespace rattan {

/// Sweeps at unit norm that settle a periodic solution.
inline constexpr int kUnitSweeps = 3;

/// Brings the complex parts of the finest level's stored solution to unit length and relaxes them
/// there. One pass over the tiles. `norms`: as in SolveOptions.
template <class Block>
void settle_at_unit_norm(SystemLevel<Block>& finest, TaskGraph& tasks, Field<PartNorms> norms = {});

/// Writes the solution's board to the store, if there is to be one, and fills in the report's
/// energies: if the options ask for them and they aren't known, by a pass.
template <class Block>
void finish_solve(const SystemLevel<Block>& finest, Store& store, const SolveOptions& options,
                  const std::optional<Evaluation>& evaluation, bool stored, SolveReport& report,
                  TaskGraph& tasks);

}  // namespace rattan
