// SPDX-License-Identifier: MIT
#include <charconv>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <sched.h>
#include <span>
#include <string>
#include <string_view>
#include <unistd.h>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "engine/core/errors.h"
#include "jobs/batch/batch_run.h"
#include "jobs/batch/batch_status.h"
#include "jobs/batch/manifest.h"
#include "jobs/batch/metrics.h"
#include "jobs/batch/shards.h"
#include "jobs/memory_share.h"
#include "jobs/report_page/report_page.h"
#include "tools/manual/option_table.h"
#include "tools/rattan/batch_console.h"
#include "tools/rattan/batch_json_log.h"
#include "tools/rattan/batch_selection.h"
#include "tools/rattan/batch_table.h"
#include "tools/rattan/commands.h"
#include "tools/rattan/exit_code.h"

namespace rattan {

namespace {

struct Arguments {
  BatchSelection selection;
  BatchRunOptions run;
  std::string write_manifest;
  std::string shard;
  std::string status;
  std::string metrics;
  std::string report;
  bool no_report = false;
  bool dry_run = false;
  bool json = false;
  bool quiet = false;
  bool verbose = false;
};

void add_batch_options(CLI::App& app, Arguments& args) {
  app.add_option("--write-manifest", args.write_manifest,
                 "write what is selected as .jsonl or .csv, and stop")
      ->type_name("FILE")
      ->group("Selection");
  app.add_option("--shard", args.shard, "only the I-th of N parts of even cost, I from 1")
      ->type_name("I/N")
      ->group("Selection");
  app.add_flag("--retry-failed", args.run.retry_failed,
               "do again what failed, though nothing changed")
      ->group("Run");
  app.add_flag("--fresh", args.run.fresh, "do everything again")->group("Run");
  app.add_option("--jobs", args.run.jobs, "most scans at once; default by threads and memory")
      ->check(CLI::Range(1, 4096))
      ->type_name("N")
      ->group(more("Run"));
  app.add_option("--threads", args.run.threads, "of all scans together; default all processors")
      ->check(CLI::Range(0, 4096))
      ->type_name("N")
      ->group("Run");
  app.add_option("--memory", args.run.memory,
                 "of all scans together, e.g. 16GiB; default from the machine")
      ->transform(CLI::AsSizeValue(false))
      ->type_name("SIZE")
      ->group("Run");
  app.add_option("--work-dir", args.run.work_directory,
                 "folder of intermediate data; default beside the outputs")
      ->type_name("DIR")
      ->group(more("Run"));
  app.add_flag("--dry-run", args.dry_run, "print what would be done and what it takes, and stop")
      ->group("Run");
  app.add_flag("--no-report", args.no_report, "no report.html, thumbnails and 3D views")
      ->group("Run");
  app.add_option("--metrics", args.metrics, "keep figures for Prometheus in a text file")
      ->type_name("FILE")
      ->group(more("Run"));
  auto* quiet = app.add_flag("--quiet", args.quiet, "only warnings and errors")->group("Run");
  app.add_flag("--verbose", args.verbose, "a line for every scan")->excludes(quiet)->group("Run");
}

void add_look_options(CLI::App& app, Arguments& args) {
  auto* status =
      app.add_option("--status", args.status, "say how the batch in DIR stands, and stop")
          ->type_name("DIR")
          ->group("Look");
  app.add_option("--report", args.report, "write report.html and report.json of DIR, and stop")
      ->type_name("DIR")
      ->excludes(status)
      ->group("Look");
  app.add_flag("--json", args.json, "the status as JSON")->needs(status)->group("Look");
}

struct Shard {
  std::uint32_t part = 0;  ///< from 1
  std::uint32_t parts = 0;
};

Shard parse_shard(std::string_view text) {
  Shard shard;
  const char* end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, shard.part);
  if (first.ec == std::errc() && first.ptr != end && *first.ptr == '/') {
    const auto second = std::from_chars(first.ptr + 1, end, shard.parts);
    if (second.ec == std::errc() && second.ptr == end && shard.part >= 1 &&
        shard.part <= shard.parts && shard.parts <= 1'000'000) {
      return shard;
    }
  }
  throw UsageError(fmt::format(
      "--shard {}: this is no part of a whole. Write e.g. 3/8, from 1/8 to 8/8.", text));
}

std::vector<BatchItem> take_shard(std::vector<BatchItem> items, const Shard& shard) {
  std::vector<double> costs;
  costs.reserve(items.size());
  for (const BatchItem& item : items) {
    costs.push_back(item_cost(item));
  }
  const std::vector<std::uint32_t> part_of = pack(costs, shard.parts);
  std::vector<BatchItem> part;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (part_of[i] == shard.part - 1) {
      part.push_back(std::move(items[i]));
    }
  }
  return part;
}

int processors() {
  cpu_set_t set;
  return ::sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1;
}

int dry_run(const std::vector<BatchItem>& items, const BatchRunOptions& run) {
  const BatchTable table = batch_table(items, plan_batch(items, run),
                                       run.memory > 0 ? run.memory : default_memory_share(),
                                       run.threads > 0 ? run.threads : processors());
  fmt::print("{}", table.text);
  return table.fits ? kExitDone : kExitResource;
}

int write_selection(const std::vector<BatchItem>& items, const std::string& file, bool quiet) {
  std::vector<double> costs;
  costs.reserve(items.size());
  for (const BatchItem& item : items) {
    costs.push_back(item_cost(item));
  }
  write_manifest(file, items, costs);
  if (!quiet) {
    fmt::print("{}: {} scan{}\n", file, items.size(), items.size() == 1 ? "" : "s");
  }
  return kExitDone;
}

// Where the page is, for people.
void report(const std::string& directory, std::span<const BatchItem> items, bool quiet) {
  const ReportTotals totals = write_batch_report(directory, items);
  if (!quiet) {
    fmt::print("{}: {} of {} scan{} done\n",
               (std::filesystem::path(directory) / "report.html").string(),
               totals.with(ScanStatus::kDone), totals.scans, totals.scans == 1 ? "" : "s");
  }
}

int run_and_report(const std::vector<BatchItem>& items, const Arguments& args, bool quiet) {
  const int exit = run_batch(items, args.run);
  // Parts of a batch would write over each other's page: --report makes it, once all are through.
  if (!args.no_report && args.run.shards == 0) {
    report(args.run.directory, items, quiet);
  }
  return exit;
}

int run(Arguments& args, JsonLog* log) {
  const BatchSelection& selection = args.selection;
  if (!args.report.empty()) {
    report(args.report, {}, args.quiet || log != nullptr);
    return kExitDone;
  }
  if (!args.status.empty()) {
    const BatchStatus status = read_batch_status(args.status);
    if (args.json) {
      fmt::print("{}\n", to_json(status).dump(2));
    } else {
      fmt::print("{}", describe(status));
    }
    return kExitDone;
  }
  if (selection.directory.empty() && args.write_manifest.empty()) {
    throw UsageError(
        "The remeshes need a folder. Name it with -o, e.g. rattan batch scans -o remeshes.");
  }
  if (!args.write_manifest.empty() && !is_manifest_name(args.write_manifest)) {
    throw UsageError(fmt::format(
        "--write-manifest {}: the extension says which format to write. Use .jsonl or .csv.",
        args.write_manifest));
  }
  const Shard shard = args.shard.empty() ? Shard{} : parse_shard(args.shard);
  const auto warn = [&](const std::string& sentence) {
    if (log != nullptr) {
      log->warning(sentence);
    } else {
      fmt::print(stderr, "rattan: warning: {}\n", sentence);
    }
  };
  std::vector<BatchItem> items = select_items(selection, warn);
  args.run.total = items.size();
  if (shard.parts > 0) {
    args.run.shard = shard.part;
    args.run.shards = shard.parts;
    items = take_shard(std::move(items), shard);
  }
  if (!args.write_manifest.empty()) {
    return write_selection(items, args.write_manifest, args.quiet);
  }
  args.run.directory = selection.directory;
  args.run.report = !args.no_report;
  if (args.dry_run) {
    return dry_run(items, args.run);
  }
  std::optional<BatchMetrics> metrics;
  if (!args.metrics.empty()) {
    BatchMetrics::Labels labels = {{"directory", selection.directory}};
    if (shard.parts > 0) {
      labels.emplace_back("shard", args.shard);
    }
    metrics.emplace(args.metrics, std::move(labels));
    args.run.observers.push_back(&*metrics);
  }
  if (log != nullptr) {
    BatchJsonLog events(*log, selection.directory, args.quiet);
    args.run.observers.push_back(&events);
    return run_and_report(items, args, true);
  }
  BatchConsole console(args.quiet     ? Verbosity::kQuiet
                       : args.verbose ? Verbosity::kVerbose
                                      : Verbosity::kNormal);
  args.run.observers.push_back(&console);
  return run_and_report(items, args, args.quiet);
}

}  // namespace

void add_batch_command(CLI::App& app, Action& action, JsonLog* log) {
  auto args = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("batch", "Convert many scans; again, only what is missing or changed.");
  add_selection_options(*command, args->selection);
  add_batch_options(*command, *args);
  add_look_options(*command, *args);
  add_log_format_option(*command);
  command->callback([args, log, &action] {
    action = [args, log] {
      const int exit = run(*args, log);
      if (log != nullptr) {
        log->end(exit);
      }
      return exit;
    };
  });
}

}  // namespace rattan
