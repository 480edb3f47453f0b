// SPDX-License-Identifier: MIT
#pragma once

// A batch handed to Slurm. Below the batch's directory:
//
//     .rattan/slurm/manifest.jsonl     all scans of the last submission's selection
//     .rattan/slurm/logs/              what the tasks and the merge said
//     .rattan/slurm/N/                 the Nth submission: NAME.sh and NAME.jsonl for each array,
//                                      merge.sh, submit.sh, plan.json, and jobs once submitted

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "jobs/batch/batch_item.h"
#include "jobs/batch/batch_run.h"
#include "jobs/slurm/command_output.h"
#include "jobs/slurm/job_script.h"
#include "jobs/slurm/slurm_site.h"
#include "jobs/slurm/task_plan.h"

namespace rattan {

/// Scans that earlier submissions still have in the queue or at work.
struct ScansInHand {
  struct Hand {
    std::string task;  ///< "<array>_<task>"
    std::string scan;
    std::string key;
  };
  std::map<std::string, Hand> by_id;
  std::vector<std::string> jobs;  ///< ids of the arrays that they belong to
};

/// Asks `squeue` about every array that was submitted for this directory. Throws ResourceError
/// where Slurm doesn't answer.
ScansInHand read_scans_in_hand(const std::string& directory, const CommandRunner& run);

struct SubmissionRequest {
  std::string directory;  ///< absolute
  TaskWishes wishes;
  /// directory, folder, most_tasks, merge_minutes and earlier_jobs are filled in here.
  ScriptSettings script;
  bool retry_failed = false;
  std::string command;  ///< as typed, quoted: what to say to go on
};

struct Submission {
  std::uint64_t selected = 0;
  std::uint64_t done = 0;
  std::uint64_t failed = 0;   ///< and to be left at that
  std::uint64_t in_hand = 0;  ///< of earlier submissions
  std::uint64_t to_do = 0;
  std::string folder;  ///< empty if there is nothing to do
  std::vector<TaskArray> arrays;
  std::vector<std::string> warnings;
};

/// The folder of the WorkLock to hold from prepare_submission() to submit().
std::string submission_lock(const std::string& directory);

/// Finds what is missing, packs it into tasks and writes the folder of a new submission; nothing is
/// submitted. Throws UsageError where a scan is in the hands
/// of a task with other options, or no node has what was asked for.
Submission prepare_submission(const std::vector<BatchItem>& items, SubmissionRequest request,
                              const SlurmSite& site, const CommandRunner& run);

/// An array or the merge that was submitted.
struct SubmittedJob {
  std::string name;  ///< of the array, or "merge"
  std::uint32_t first = 0;
  std::string id;
};

/// Runs the folder's submit.sh. Throws ResourceError with Slurm's words where it refuses.
std::vector<SubmittedJob> submit(const std::string& folder, const CommandRunner& run);

/// What is neither done, failed for good, nor in the hands of a task.
struct MissingScans {
  std::vector<std::pair<std::string, Standing>> scans;  ///< ids
  std::uint64_t in_hand = 0;
  std::string command;  ///< that submits them
};
MissingScans find_missing(const std::vector<BatchItem>& items, const std::string& directory,
                          const CommandRunner& run);

/// DIR/.rattan/slurm/manifest.jsonl.
std::string slurm_manifest(const std::string& directory);

}  // namespace rattan
