// SPDX-License-Identifier: MIT
#pragma once

// The text of the scripts that Slurm runs, and of the one that submits them.

#include <cstdint>
#include <string>
#include <vector>

#include "jobs/slurm/task_plan.h"

namespace rattan {

/// What all scripts of a submission share.
struct ScriptSettings {
  std::string program;    ///< absolute path of rattan, on every node
  std::string directory;  ///< absolute path of the batch's directory
  std::string folder;     ///< absolute path of the submission's folder; holds scripts and manifests
  std::string partition;
  std::string account;
  std::string qos;
  std::vector<std::string> batch_words;   ///< more for `rattan batch`, e.g. --retry-failed
  std::vector<std::string> sbatch_words;  ///< more for sbatch
  std::uint32_t at_once = 0;              ///< most tasks of an array at once; 0: no limit
  std::uint32_t most_tasks = 1000;        ///< of one array
  std::uint64_t merge_minutes = 60;
  std::vector<std::string> earlier_jobs;  ///< still at work in the directory: the merge waits
};

/// One word of a shell, whatever is in the text, newlines included.
std::string shell_quoted(const std::string& text);

/// The words of a command line, quoted where they need it.
std::string command_line(const std::vector<std::string>& words);

/// NAME.sh: a task of the array. It reads NAME.jsonl beside it.
std::string task_script(const TaskArray& array, const ScriptSettings& settings);

/// merge.sh: writes the report, and says which scans are missing.
std::string merge_script(const ScriptSettings& settings);

/// submit.sh: submits the arrays and the merge, and keeps their job ids in the file `jobs`: lines
/// "NAME FIRST ID", where FIRST is how many of NAME's tasks come before this array's.
std::string submit_script(const std::vector<TaskArray>& arrays, const ScriptSettings& settings);

}  // namespace rattan
