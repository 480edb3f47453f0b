// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "engine/core/progress.h"
#include "engine/mesh/tile_mesh.h"

namespace rattan {

/// A sentence for every repair that changes what the scan looks like or how its parts connect; the
/// counts of all are in the report.
void warn_of_repairs(const std::string& scan, const RepairCounts& repaired, ProgressSink& progress);

}  // namespace rattan
