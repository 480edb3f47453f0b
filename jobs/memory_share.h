// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace rattan {

/// Where limits are read from; replaced in tests.
struct MemorySources {
  std::string root;  ///< before /proc and /sys
  std::function<const char*(const char*)> environment;
};

/// Bytes that this process is granted: by the machine (what is free now), by its control groups and
/// all above them (versions 1 and 2, less what they use already), and by Slurm (SLURM_MEM_PER_NODE,
/// or SLURM_MEM_PER_CPU times SLURM_CPUS_ON_NODE, in MiB).
std::uint64_t granted_memory(const MemorySources& sources);

/// Half of what is granted, at least 256 MiB; of this machine.
std::uint64_t default_memory_share();

}  // namespace rattan
