// SPDX-License-Identifier: MIT
#pragma once

#include "engine/core/progress.h"
#include "jobs/job_events.h"
#include "jobs/remesh_options.h"
#include "jobs/report.h"
#include "jobs/stop_requests.h"

namespace rattan {

/// One scan in, one verified remesh out: the whole pipeline, stage by stage. Writes options.output,
/// and the report and preview where asked for. Takes up what an earlier run with these options left
/// in the work directory; leaves nothing there after success, and what it takes to resume after an
/// exception. `events`, if any, hears how it goes. Throws the exceptions of engine/core/errors.h.
RemeshReport remesh_scan(const RemeshOptions& options, ProgressSink& progress,
                         const StopRequests& stop = {}, JobEvents* events = nullptr);

}  // namespace rattan
