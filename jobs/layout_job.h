// SPDX-License-Identifier: MIT
#pragma once

#include "engine/core/progress.h"
#include "jobs/job_events.h"
#include "jobs/layout_report.h"
#include "jobs/stop_requests.h"

namespace rattan {

/// Makes the global parameterization of one scan: charts with texture coordinates, how they meet,
/// and the base complex, each written complete and verified. Saved work of an earlier run with the
/// same command is taken up. `events` may be null. Throws UsageError, InputError, ResourceError,
/// Cancelled.
LayoutReport layout_scan(const LayoutOptions& options, ProgressSink& progress,
                         const StopRequests& stop = {}, JobEvents* events = nullptr);

}  // namespace rattan
