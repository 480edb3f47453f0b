// SPDX-License-Identifier: MIT
#pragma once

// How a command on one scan runs: the options that say so, and the run with a console or a log, or
// as a dry run.

#include <cstdlib>
#include <utility>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "jobs/remesh_plan.h"
#include "jobs/scan_options.h"
#include "jobs/stop_requests.h"
#include "tools/rattan/console.h"
#include "tools/rattan/exit_code.h"
#include "tools/rattan/interruption.h"
#include "tools/rattan/json_log.h"

namespace rattan {

struct RunFlags {
  bool quiet = false;
  bool verbose = false;
  bool dry_run = false;

  Verbosity verbosity() const {
    return quiet ? Verbosity::kQuiet : verbose ? Verbosity::kVerbose : Verbosity::kNormal;
  }
};

/// Group Run. Of single scans alone: a batch decides these for its runs.
void add_process_options(CLI::App& command, ScanOptions& o, RunFlags& flags);

/// What a log ends with after a dry run; the exit code.
int log_plan(const RemeshPlan& plan, JsonLog& log);
/// What was left to the machine, filled in: a log tells it.
void fill_in_machine(ScanOptions& o);
/// Tells the log of signals.
Interruption::Say interruption_to(JsonLog& log);

/// plan(options, progress) -> RemeshPlan; work(options, progress, stop, events) -> a report, which
/// say(report) prints. `log` null: on the console.
template <class Options, class Plan, class Work, class Say>
int run_scan(Options o, const RunFlags& flags, JsonLog* log, const Plan& plan, const Work& work,
             const Say& say) {
  if (const char* seconds = std::getenv("RATTAN_CHECKPOINT_SECONDS")) {
    o.checkpoint_seconds = std::strtod(seconds, nullptr);
  }
  if (log != nullptr) {
    log->set_quiet(flags.quiet);
    if (flags.dry_run) {
      return log_plan(plan(o, *log), *log);
    }
    fill_in_machine(o);
    {
      Interruption interruption(interruption_to(*log));
      log->start(o);
      work(o, *log, StopRequests{interruption.soon(), interruption.now()}, log);
    }
    log->end(kExitDone);
    return kExitDone;
  }
  if (flags.dry_run) {
    Console console(flags.verbosity());
    const RemeshPlan planned = plan(o, console);
    fmt::print("{}", describe(planned));
    return planned.fits() ? kExitDone : kExitResource;
  }
  const auto report = [&] {
    Interruption interruption;
    Console console(flags.verbosity());
    return work(o, console, StopRequests{interruption.soon(), interruption.now()}, nullptr);
  }();
  if (!flags.quiet) {
    say(report);
  }
  return kExitDone;
}

}  // namespace rattan
