// SPDX-License-Identifier: MIT
#pragma once

#include "engine/core/progress.h"
#include "jobs/remesh_options.h"
#include "jobs/report.h"

namespace rattan {

/// One scan in, one verified remesh out: the whole pipeline, stage by stage. Writes options.output,
/// and the report and preview where asked for. Throws the exceptions of engine/core/errors.h.
RemeshReport remesh_scan(const RemeshOptions& options, ProgressSink& progress);

}  // namespace rattan
