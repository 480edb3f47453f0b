// SPDX-License-Identifier: MIT
#include <memory>

#include <fmt/format.h>

#include "engine/core/errors.h"
#include "engine/core/memory_budget.h"
#include "jobs/export_job.h"
#include "tools/rattan/commands.h"
#include "tools/rattan/console.h"
#include "tools/rattan/interruption.h"

namespace rattan {

namespace {

struct Arguments {
  ExportOptions options;
  bool quiet = false;
};

int run(const Arguments& args) {
  ExportSummary summary;
  try {
    const Interruption interruption;
    Console console(args.quiet ? Verbosity::kQuiet : Verbosity::kNormal);
    summary = export_work(args.options, console, interruption.soon());
  } catch (const Cancelled&) {
    throw Cancelled(args.options.output +
                    ": stopped before the file was complete; run the same command again.");
  }
  if (!args.quiet) {
    fmt::print("{}: {} points, {} triangles, {}\n", args.options.output, summary.points,
               summary.triangles, format_bytes(summary.bytes));
    if (!summary.missing.empty()) {
      fmt::print("Not there yet: {}.\n", fmt::join(summary.missing, ", "));
    }
  }
  return 0;
}

}  // namespace

void add_export_command(CLI::App& app, Action& action) {
  auto args = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("export", "Write the fields of a kept work directory for ParaView.");
  command
      ->add_option("work", args->options.work,
                   "work directory of a run with --keep-work, or of one that was interrupted")
      ->type_name("DIR")
      ->required();
  command
      ->add_option("-o,--output", args->options.output,
                   "VTKHDF file to write: .vtkhdf or .hdf (VTK 9.1, ParaView 5.10 and later)")
      ->type_name("FILE")
      ->required();
  command
      ->add_option("--memory", args->options.memory,
                   "most memory that the process may fill, e.g. 2GiB; default from the machine")
      ->transform(CLI::AsSizeValue(false))
      ->type_name("SIZE");
  command->add_option("--threads", args->options.threads, "threads at work, 0 for one a processor")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  command->add_flag("--quiet", args->quiet, "print nothing but errors");
  command->callback([args, &action] { action = [args] { return run(*args); }; });
}

}  // namespace rattan
