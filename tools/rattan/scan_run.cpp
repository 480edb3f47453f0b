// SPDX-License-Identifier: MIT
#include "tools/rattan/scan_run.h"

#include <oneapi/tbb/task_arena.h>

#include "jobs/memory_share.h"

namespace rattan {

void add_process_options(CLI::App& command, ScanOptions& o, RunFlags& flags) {
  command.add_flag("--fresh", o.fresh, "start anew, whatever an earlier run left in that folder")
      ->group("Run");
  command
      .add_flag("--dry-run", flags.dry_run,
                "read the scan, print what the run would take, and stop")
      ->group("Run");
  command.add_option("--report", o.report, "write a JSON report")->type_name("FILE")->group("Run");
  add_log_format_option(command);
  auto* quiet = command.add_flag("--quiet", flags.quiet, "only warnings and errors")->group("Run");
  command.add_flag("--verbose", flags.verbose, "a line for every stage")
      ->excludes(quiet)
      ->group("Run");
}

int log_plan(const RemeshPlan& plan, JsonLog& log) {
  log.plan(plan);
  if (!plan.fits()) {
    log.error("Memory or disk will not do.", kExitResource);
    return kExitResource;
  }
  log.end(kExitDone);
  return kExitDone;
}

void fill_in_machine(ScanOptions& o) {
  o.memory = o.memory > 0 ? o.memory : default_memory_share();
  o.threads = o.threads > 0 ? o.threads : oneapi::tbb::this_task_arena::max_concurrency();
}

Interruption::Say interruption_to(JsonLog& log) {
  return [&log](Interruption::Moment moment, const char* sentence) {
    if (moment == Interruption::Moment::kStopping) {
      log.stopping(sentence);
    } else {
      log.error(sentence, kExitInterrupted);
    }
  };
}

}  // namespace rattan
