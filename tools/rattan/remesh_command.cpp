// SPDX-License-Identifier: MIT
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include <fmt/format.h>
#include <oneapi/tbb/task_arena.h>

#include "engine/core/resident_memory.h"
#include "jobs/memory_share.h"
#include "jobs/remesh_job.h"
#include "jobs/remesh_plan.h"
#include "tools/rattan/commands.h"
#include "tools/rattan/console.h"
#include "tools/rattan/exit_code.h"
#include "tools/rattan/interruption.h"
#include "tools/rattan/remesh_arguments.h"

namespace rattan {

namespace {

struct Arguments {
  RemeshArguments remesh;
  bool quiet = false;
  bool verbose = false;
  bool dry_run = false;
};

// Of this command alone: a batch decides them for its runs.
void add_process_options(CLI::App& command, Arguments& args) {
  RemeshOptions& o = args.remesh.options;
  command.add_flag("--fresh", o.fresh, "start anew, whatever an earlier run left in that folder")
      ->group("Run");
  command
      .add_flag("--dry-run", args.dry_run, "read the scan, print what the run would take, and stop")
      ->group("Run");
  command.add_option("--report", o.report, "write a JSON report")->type_name("FILE")->group("Run");
  add_log_format_option(command);
  // For the report of a batch, so not on the help screen.
  command.add_option("--thumbnail", o.thumbnail, "write a small PNG of the remesh")->group("");
  command.add_option("--viewer", o.viewer, "write the remesh as a script, for a 3D view")
      ->group("");
  auto* quiet = command.add_flag("--quiet", args.quiet, "only warnings and errors")->group("Run");
  command.add_flag("--verbose", args.verbose, "a line for every stage")
      ->excludes(quiet)
      ->group("Run");
}

int plan_logged(const RemeshOptions& options, JsonLog& log) {
  const RemeshPlan plan = plan_remesh(options, log);
  log.plan(plan);
  if (!plan.fits()) {
    log.error("Memory or disk will not do.", kExitResource);
    return kExitResource;
  }
  log.end(kExitDone);
  return kExitDone;
}

/// Whether the scan, from the bytes of its file, takes at most half of the memory it may, and a
/// second or so: later the allocator gives pages back, which large ones suffer from. Files that are
/// compressed don't tell.
bool small(const RemeshOptions& options) {
  constexpr std::uint64_t kProgramBytes = 32U << 20;
  constexpr std::uint64_t kBytesPerFileByte = 12;
  constexpr std::uint64_t kMostBytes = 8U << 20;
  const std::filesystem::path scan(options.scan);
  const std::string format = scan.extension().string();
  if (format != ".ply" && format != ".obj" && format != ".stl" && format != ".off") {
    return false;
  }
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(scan, error);
  const std::uint64_t memory = options.memory > 0 ? options.memory : default_memory_share();
  return !error && bytes <= kMostBytes && 2 * (kProgramBytes + kBytesPerFileByte * bytes) <= memory;
}

int run_logged(RemeshOptions options, JsonLog& log) {
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
    remesh_scan(options, log, {interruption.soon(), interruption.now()}, &log);
  }
  log.end(kExitDone);
  return kExitDone;
}

int run(const Arguments& args, JsonLog* log) {
  if (log != nullptr) {
    log->set_scan(args.remesh.options.scan);
  }
  RemeshOptions o = args.remesh.resolve();
  if (const char* seconds = std::getenv("RATTAN_CHECKPOINT_SECONDS")) {
    o.checkpoint_seconds = std::strtod(seconds, nullptr);
  }
  const Verbosity verbosity = args.quiet     ? Verbosity::kQuiet
                              : args.verbose ? Verbosity::kVerbose
                                             : Verbosity::kNormal;
  if (!args.dry_run && small(o)) {
    prefer_large_pages();
  }
  if (log != nullptr) {
    log->set_quiet(args.quiet);
    return args.dry_run ? plan_logged(o, *log) : run_logged(o, *log);
  }
  if (args.dry_run) {
    Console console(verbosity);
    const RemeshPlan plan = plan_remesh(o, console);
    fmt::print("{}", describe(plan));
    return plan.fits() ? kExitDone : kExitResource;
  }
  RemeshReport report;
  {
    Interruption interruption;
    Console console(verbosity);
    report = remesh_scan(o, console, {interruption.soon(), interruption.now()});
  }
  if (verbosity != Verbosity::kQuiet) {
    for (const auto& [output, singularities, distance, shared_with] : report.outputs) {
      fmt::print("{}: {} faces, {:.1f} % quads, {} bytes, {:.1f} s\n", output.path, output.faces,
                 output.faces == 0 ? 0.0
                                   : 100.0 * static_cast<double>(output.quads) /
                                         static_cast<double>(output.faces),
                 output.bytes, report.seconds);
    }
  }
  return 0;
}

}  // namespace

void add_remesh_command(CLI::App& app, Action& action, JsonLog* log) {
  auto args = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("remesh", "Convert one scan into a curvature-aligned quad-dominant mesh.");
  command
      ->add_option("scan", args->remesh.options.scan,
                   "PLY, OBJ, STL, OFF or Draco file, as it is or with .gz or .zst")
      ->required();
  command
      ->add_option("-o,--output", args->remesh.options.output,
                   "remesh to write: .drc, .obj, .ply or .off; for several sizes {faces}, {size} "
                   "or {n} in it "
                   "stand for the size and its place in the list")
      ->type_name("OUT")
      ->required();
  add_scan_options(*command, args->remesh);
  add_run_options(*command, args->remesh);
  add_process_options(*command, *args);
  command->callback([args, &action, log] { action = [args, log] { return run(*args, log); }; });
}

}  // namespace rattan
