// SPDX-License-Identifier: MIT
#pragma once

// Which scans go together into a task of a job array, and what each task asks for.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "jobs/slurm/slurm_site.h"

namespace rattan {

/// A scan as far as it counts here.
struct TaskScan {
  double cpu_seconds = 0.0;
  std::uint64_t least_memory = 0;  ///< bytes
  std::uint64_t good_memory = 0;   ///< bytes with which nothing goes to disk and back
};

/// What the user decides; the rest is chosen.
struct TaskWishes {
  std::uint32_t tasks = 0;                 ///< of scans that share a task; 0: chosen
  std::uint32_t processors = 0;            ///< of a task; 0: chosen
  std::optional<std::uint64_t> mebibytes;  ///< of a task; 0: all of a node
  std::uint64_t minutes = 0;               ///< of a task; 0: chosen
};

/// Tasks that ask for the same.
struct TaskArray {
  std::string name;                  ///< "scans", or "large-16G" where each task is one huge scan
  std::vector<std::uint32_t> scans;  ///< indexes, ascending
  std::vector<std::uint32_t> task;   ///< of each, from 0: what `--shard` gives for these costs
  std::uint32_t tasks = 0;
  std::uint32_t processors = 0;
  std::uint64_t mebibytes = 0;
  std::uint64_t minutes = 0;
  double longest_seconds = 0.0;   ///< predicted, of a task
  double shortest_seconds = 0.0;  ///< predicted, of a task
};

/// MiB that a task gives Rattan of those that Slurm granted it; the scripts do the same sum.
constexpr std::uint64_t memory_inside(std::uint64_t mebibytes) {
  return mebibytes * 9 / 10;
}

/// Scans that need no more memory than their share of a common node are packed into tasks of even
/// cost; a larger one is a task of its own, in an array of those that ask for as much memory.
/// Throws UsageError where no node has what the wishes ask for.
std::vector<TaskArray> plan_tasks(std::span<const TaskScan> scans, const TaskWishes& wishes,
                                  const SlurmSite& site);

/// Arrays that a site's limit cuts these tasks into: how many tasks each, in order.
std::vector<std::uint32_t> array_sizes(std::uint32_t tasks, std::uint32_t most);

/// Seconds before the time limit at which a task is told: a minute, or a quarter of a short limit.
std::uint64_t warning_seconds(std::uint64_t minutes);

}  // namespace rattan
