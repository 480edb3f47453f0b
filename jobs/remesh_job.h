// SPDX-License-Identifier: MIT
#pragma once

#include <stop_token>

#include "engine/core/progress.h"
#include "jobs/job_events.h"
#include "jobs/remesh_options.h"
#include "jobs/report.h"

namespace rattan {

/// Requests to stop, see tools/rattan/interruption.h. Default: never.
struct StopRequests {
  /// At the end of the step: its work is saved.
  std::stop_token soon;
  /// At once: what the last checkpoint holds stays.
  std::stop_token now;
};

/// One scan in, one verified remesh out: the whole pipeline, stage by stage. Writes options.output,
/// and the report and preview where asked for. Takes up what an earlier run with these options left
/// in the work directory; leaves nothing there after success, and what it takes to resume after an
/// exception. `events`, if any, hears how it goes. Throws the exceptions of engine/core/errors.h.
RemeshReport remesh_scan(const RemeshOptions& options, ProgressSink& progress,
                         const StopRequests& stop = {}, JobEvents* events = nullptr);

}  // namespace rattan
