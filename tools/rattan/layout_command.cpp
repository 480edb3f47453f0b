// SPDX-License-Identifier: MIT
#include <cstdlib>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <oneapi/tbb/task_arena.h>

#include "engine/core/errors.h"
#include "jobs/layout_job.h"
#include "jobs/memory_share.h"
#include "jobs/remesh_plan.h"
#include "tools/manual/option_table.h"
#include "tools/rattan/commands.h"
#include "tools/rattan/console.h"
#include "tools/rattan/exit_code.h"
#include "tools/rattan/interruption.h"
#include "tools/rattan/scan_arguments.h"

namespace rattan {

namespace {

struct Arguments {
  LayoutOptions options;
  double smoothing = 0.0;
  bool quiet = false;
  bool verbose = false;
  bool dry_run = false;
};

void add_layout_options(CLI::App& command, LayoutOptions& o) {
  command
      .add_option("--chart-size", o.chart_size,
                  "side of a chart, in the file's units; default ten mean edges")
      ->check(CLI::Range(1e-30, 1e30))
      ->type_name("LENGTH")
      ->group("Charts");
  command
      .add_option("--relax", o.relax,
                  "rounds that smooth coordinates across borders of repaired charts; 6 do")
      ->check(CLI::Range(0, 1000))
      ->default_str("0")
      ->type_name("N")
      ->group("Charts");
  command.add_flag("--atlas", o.atlas, "one unit square of texture coordinates for all charts")
      ->group("Charts");
  command
      .add_option("--bake", o.bake,
                  "write a PNG of SIZE x SIZE texels for the atlas, with the scan's colours")
      ->check(CLI::Range(16, 32768))
      ->type_name("SIZE")
      ->group("Charts");
}

int plan_logged(const LayoutOptions& options, JsonLog& log) {
  const RemeshPlan plan = plan_layout(options, log);
  log.plan(plan);
  if (!plan.fits()) {
    log.error("Memory or disk will not do.", kExitResource);
    return kExitResource;
  }
  log.end(kExitDone);
  return kExitDone;
}

int run_logged(LayoutOptions options, JsonLog& log) {
  // What is left to the machine is told, too.
  options.memory = options.memory > 0 ? options.memory : default_memory_share();
  options.threads =
      options.threads > 0 ? options.threads : oneapi::tbb::this_task_arena::max_concurrency();
  {
    Interruption interruption([&](Interruption::Moment moment, const char* sentence) {
      if (moment == Interruption::Moment::kStopping) {
        log.stopping(sentence);
      } else {
        log.error(sentence, kExitInterrupted);
      }
    });
    log.start(options);
    layout_scan(options, log, {interruption.soon(), interruption.now()}, &log);
  }
  log.end(kExitDone);
  return kExitDone;
}

int run(const Arguments& args, JsonLog* log) {
  LayoutOptions o = args.options;
  if (log != nullptr) {
    log->set_scan(o.scan);
    log->set_quiet(args.quiet);
  }
  if (args.smoothing > 0.0) {
    o.smoothing = args.smoothing;
  }
  if (const char* seconds = std::getenv("RATTAN_CHECKPOINT_SECONDS")) {
    o.checkpoint_seconds = std::strtod(seconds, nullptr);
  }
  const Verbosity verbosity = args.quiet     ? Verbosity::kQuiet
                              : args.verbose ? Verbosity::kVerbose
                                             : Verbosity::kNormal;
  if (log != nullptr) {
    return args.dry_run ? plan_logged(o, *log) : run_logged(o, *log);
  }
  if (args.dry_run) {
    Console console(verbosity);
    const RemeshPlan plan = plan_layout(o, console);
    fmt::print("{}", describe(plan));
    return plan.fits() ? kExitDone : kExitResource;
  }
  LayoutReport report;
  {
    Interruption interruption;
    Console console(verbosity);
    report = layout_scan(o, console, {interruption.soon(), interruption.now()});
  }
  if (verbosity != Verbosity::kQuiet) {
    const FlatCounts& c = report.charts;
    fmt::print("{}: {} charts, {:.1f} % of them parameterized anew, {} bytes, {:.1f} s\n",
               report.output.path, c.charts,
               100.0 * (c.flattened + c.split) / std::max(1.0, static_cast<double>(c.charts)),
               report.output.bytes, report.seconds);
    fmt::print("{}: base complex of {} quads\n", report.base.path, report.base.quads);
  }
  return kExitDone;
}

}  // namespace

void add_layout_command(CLI::App& app, Action& action, JsonLog* log) {
  auto args = std::make_shared<Arguments>();
  LayoutOptions& o = args->options;
  CLI::App* command = app.add_subcommand(
      "layout", "Parameterize one scan: charts with texture coordinates, and the base complex.");
  command
      ->add_option("scan", o.scan, "PLY, OBJ, STL, OFF or Draco file, as it is or with .gz or .zst")
      ->required();
  command
      ->add_option("-o,--output", o.output,
                   "layout to write: .obj, .ply or .drc; OUT.base and OUT.charts.json go beside it")
      ->type_name("OUT")
      ->required();
  add_layout_options(*command, o);
  add_repair_options(*command, o);
  add_field_options(*command, o, args->smoothing);
  add_solver_options(*command, o);
  add_position_bits_option(*command, o);
  add_resource_options(*command, o);
  command->add_flag("--fresh", o.fresh, "start anew, whatever an earlier run left in that folder")
      ->group("Run");
  command
      ->add_flag("--dry-run", args->dry_run,
                 "read the scan, print what the run would take, and stop")
      ->group("Run");
  add_log_format_option(*command);
  command->add_option("--report", o.report, "write a JSON report")->type_name("FILE")->group("Run");
  command->add_option("--preview", o.preview, "write a PNG: scan, field, iso-lines, charts, base")
      ->type_name("FILE")
      ->group("Run");
  auto* quiet = command->add_flag("--quiet", args->quiet, "only warnings and errors")->group("Run");
  command->add_flag("--verbose", args->verbose, "a line for every stage")
      ->excludes(quiet)
      ->group("Run");
  command->callback([args, &action, log] { action = [args, log] { return run(*args, log); }; });
}

}  // namespace rattan
