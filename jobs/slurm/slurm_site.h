// SPDX-License-Identifier: MIT
#pragma once

// What a Slurm site allows, as far as it decides how scans are packed into tasks.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "jobs/slurm/command_output.h"

namespace rattan {

/// Nodes of one kind.
struct SlurmNodes {
  std::uint32_t count = 0;
  std::uint32_t processors = 0;  ///< of each
  std::uint64_t mebibytes = 0;   ///< of each
};

struct SlurmSite {
  bool known = false;     ///< false where there is no Slurm; the rest are Slurm's own defaults then
  std::string partition;  ///< asked for, else the default one; may be empty
  std::uint32_t most_tasks = 1000;              ///< elements of one array whose indexes start at 1
  std::optional<std::uint64_t> most_minutes;    ///< MaxTime of the partition
  std::optional<std::uint64_t> most_mebibytes;  ///< MaxMemPerNode of the partition
  std::vector<SlurmNodes> nodes;                ///< of the partition; empty: not known

  std::uint32_t processors() const;  ///< of all nodes
  /// The most of one node, 0 where not known; memory counts MaxMemPerNode.
  std::uint32_t most_processors() const;
  std::uint64_t most_memory() const;
  /// Whether some node can hold a task like this. True where no node is known.
  bool has_room_for(std::uint32_t wanted_processors, std::uint64_t wanted_mebibytes) const;
};

/// Asks `scontrol show config`, `scontrol show partition` and `sinfo`. An empty partition is the
/// site's default one. Throws UsageError that names the partitions where there is none of this
/// name.
SlurmSite read_slurm_site(const CommandRunner& run, const std::string& partition);

/// Minutes, rounded up, of a time in one of Slurm's formats: minutes, minutes:seconds,
/// hours:minutes:seconds, days-hours, days-hours:minutes, days-hours:minutes:seconds. Nothing for
/// UNLIMITED, INFINITE, NONE and what can't be read.
std::optional<std::uint64_t> parse_slurm_time(const std::string& text);

/// days-hours:minutes:00, without the days where there are none.
std::string slurm_time(std::uint64_t minutes);

/// MiB, rounded up, of a size as `sbatch --mem` has it (4000, 4000M, 16G; 0 is all of a node), or
/// as Rattan has it (2GiB). Throws UsageError.
std::uint64_t parse_slurm_memory(const std::string& text);

}  // namespace rattan
