// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <unistd.h>
#include <vector>

#include <fmt/format.h>

#include "engine/core/errors.h"
#include "io/store/work_lock.h"
#include "jobs/slurm/submission.h"
#include "tools/rattan/batch_selection.h"
#include "tools/rattan/commands.h"
#include "tools/rattan/exit_code.h"

namespace rattan {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostNamed = 20;

struct Arguments {
  BatchSelection selection;
  std::string partition;
  std::string account;
  std::string qos;
  std::string time;
  std::string memory;
  std::string program;
  std::string check;
  std::uint32_t processors = 0;
  std::uint32_t tasks = 0;
  std::uint32_t at_once = 0;
  std::vector<std::string> sbatch;
  bool retry_failed = false;
  bool no_submit = false;
};

std::string absolute(const std::string& path) {
  std::string text = fs::absolute(path).lexically_normal().string();
  while (text.size() > 1 && text.ends_with('/')) {
    text.pop_back();
  }
  return text;
}

std::string program_path(const std::string& given) {
  std::error_code error;
  if (given.empty()) {
    return fs::read_symlink("/proc/self/exe", error).string();
  }
  if (!fs::exists(given, error)) {
    std::fprintf(stderr, "rattan: warning: --program %s isn't there on this machine.\n",
                 given.c_str());
  }
  return absolute(given);
}

/// This process's command line with the folder that it was given in.
std::string command_as_typed() {
  std::ifstream stream("/proc/self/cmdline");
  std::vector<std::string> words;
  std::string word;
  while (std::getline(stream, word, '\0')) {
    if (word != "--no-submit") {
      words.push_back(word);
    }
  }
  return fmt::format("cd {} && {}", command_line({fs::current_path().string()}),
                     command_line(words));
}

TaskWishes wishes_of(const Arguments& args, const SlurmSite& site) {
  TaskWishes wishes;
  wishes.tasks = args.tasks;
  wishes.processors = args.processors;
  if (!args.memory.empty()) {
    wishes.mebibytes = parse_slurm_memory(args.memory);
  }
  if (args.time.empty()) {
    return wishes;
  }
  wishes.minutes = parse_slurm_time(args.time).value_or(0);
  if (wishes.minutes == 0) {
    throw UsageError(fmt::format(
        "--time {}: not a time. Give minutes, hours:minutes:seconds or days-hours, e.g. 02:00:00.",
        args.time));
  }
  if (site.most_minutes && wishes.minutes > *site.most_minutes) {
    throw UsageError(fmt::format("--time {}: the partition {} allows {} at most.", args.time,
                                 site.partition, slurm_time(*site.most_minutes)));
  }
  return wishes;
}

std::string many(std::uint64_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

void tell(const Submission& s) {
  fmt::print("{}: {} done, {} failed, {} with earlier tasks, {} to do\n", many(s.selected, "scan"),
             s.done, s.failed, s.in_hand, s.to_do);
  for (const TaskArray& array : s.arrays) {
    fmt::print(
        "{}: {} in {} of {}, {} and {}; predicted {:.3g} to {:.3g} s each\n", array.name,
        many(array.scans.size(), "scan"), many(array.tasks, "task"),
        many(array.processors, "processor"),
        array.mebibytes == 0 ? "all memory of a node" : fmt::format("{} MiB", array.mebibytes),
        slurm_time(array.minutes), array.shortest_seconds, array.longest_seconds);
  }
  for (const std::string& warning : s.warnings) {
    std::fprintf(stderr, "rattan: warning: %s\n", warning.c_str());
  }
}

int run(const Arguments& args) {
  if (args.selection.directory.empty()) {
    throw UsageError("-o DIR is missing: the folder that the remeshes go to.");
  }
  const std::vector<BatchItem> items = select_items(args.selection, [](const std::string& text) {
    std::fprintf(stderr, "rattan: warning: %s\n", text.c_str());
  });
  const SlurmSite site = read_slurm_site(run_command, args.partition);
  if (!site.known && !args.no_submit) {
    throw UsageError(
        "Slurm doesn't answer here (scontrol show config). Run this on a machine that submits "
        "jobs, "
        "or only write the scripts with --no-submit.");
  }

  SubmissionRequest request;
  request.directory = absolute(args.selection.directory);
  request.wishes = wishes_of(args, site);
  request.script.program = program_path(args.program);
  request.script.partition = args.partition;
  request.script.account = args.account;
  request.script.qos = args.qos;
  request.script.sbatch_words = args.sbatch;
  request.script.at_once = args.at_once;
  request.retry_failed = args.retry_failed;
  request.command = command_as_typed();

  const WorkLock lock(submission_lock(request.directory));
  const Submission submission = prepare_submission(items, request, site, run_command);
  tell(submission);
  if (submission.folder.empty()) {
    fmt::print("Nothing to submit. The report: rattan batch --report {}\n",
               command_line({request.directory}));
    return kExitDone;
  }
  if (args.no_submit) {
    fmt::print("To submit: {}\n", command_line({submission.folder + "/submit.sh"}));
    return kExitDone;
  }
  for (const auto& [name, first, id] : submit(submission.folder, run_command)) {
    fmt::print("job {}: {}\n", id, name);
  }
  fmt::print("Progress: rattan batch --status {}\n", command_line({request.directory}));
  return kExitDone;
}

/// Which scans of the last submission are neither done, failed, nor with a task.
int check(const std::string& given) {
  const std::string directory = absolute(given);
  BatchSelection selection;
  selection.paths = {slurm_manifest(directory)};
  selection.directory = directory;
  if (!fs::exists(selection.paths.front())) {
    throw InputError(directory, "", "no batch was submitted to Slurm from here",
                     "Name the folder that was given as -o to rattan slurm");
  }
  const std::vector<BatchItem> items = select_items(selection, [](const std::string&) {});
  const MissingScans missing = find_missing(items, directory, run_command);
  if (missing.in_hand > 0) {
    fmt::print("{} scans are still with tasks of Slurm.\n", missing.in_hand);
  }
  if (missing.scans.empty()) {
    fmt::print("Of {} scans none is missing.\n", items.size());
    return kExitDone;
  }
  fmt::print("{} of {} scans are neither done nor failed:\n", missing.scans.size(), items.size());
  for (std::size_t k = 0; k < std::min(missing.scans.size(), kMostNamed); ++k) {
    fmt::print("  {} ({})\n", missing.scans[k].first, describe(missing.scans[k].second));
  }
  if (missing.scans.size() > kMostNamed) {
    fmt::print("  and {} more\n", missing.scans.size() - kMostNamed);
  }
  fmt::print("The command that submitted them submits what is missing:\n  {}\n", missing.command);
  return kExitInterrupted;
}

}  // namespace

void add_slurm_command(CLI::App& app, Action& action) {
  auto args = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("slurm", "Submit a batch to a Slurm cluster: a job array and its report.");
  add_selection_options(*command, args->selection);
  const auto option = [&](const std::string& name, auto& value, const char* type,
                          const std::string& text) {
    return command->add_option(name, value, text)->type_name(type)->group("Slurm");
  };
  option("--partition", args->partition, "NAME", "where to run; default the site's default");
  option("--account", args->account, "NAME", "whom to charge");
  option("--qos", args->qos, "NAME", "quality of service");
  option("--time", args->time, "TIME", "limit of a task, as in sbatch; default from the cost");
  option("--cpus-per-task", args->processors, "N", "processors and threads of a task; default 4")
      ->check(CLI::Range(1, 4096));
  option("--mem", args->memory, "SIZE", "memory of a task, as in sbatch; default from the scans");
  option("--tasks", args->tasks, "N", "tasks that scans of common size are packed into")
      ->check(CLI::Range(1, 4'000'000));
  option("--nodes-at-once", args->at_once, "N", "most tasks of an array that run at once")
      ->check(CLI::Range(1, 4'000'000));
  option("--sbatch", args->sbatch, "OPTION", "another option for sbatch; may be repeated")
      ->allow_extra_args(false);
  option("--program", args->program, "PATH", "rattan as the nodes see it; default this program");
  command->add_flag("--retry-failed", args->retry_failed, "do failed scans again, too")
      ->group("Slurm");
  command->add_flag("--no-submit", args->no_submit, "write the scripts, and submit nothing")
      ->group("Slurm");
  option("--check", args->check, "DIR",
         "say what a submission left undone and how to go on; exit 75 if anything is");
  command->callback([args, &action] {
    action = [args] { return args->check.empty() ? run(*args) : check(args->check); };
  });
}

}  // namespace rattan
