// SPDX-License-Identifier: MIT
#pragma once

// The part of a hierarchy that lives in memory, as chunks of the store, so that a later run finds
// it.

#include <memory>

#include "engine/core/store.h"
#include "engine/solve/solver.h"

namespace rattan {

void save_hierarchy(Store& store, const Hierarchy& hierarchy);
/// Pre: saved before, for this store.
std::shared_ptr<const Hierarchy> load_hierarchy(Store& store);

}  // namespace rattan
