// SPDX-License-Identifier: MIT
#include "jobs/memory_share.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <optional>
#include <sstream>

namespace rattan {

namespace {

constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();
constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;

std::uint64_t free_bytes(const std::string& root) {
  std::ifstream file(root + "/proc/meminfo");
  std::string name;
  std::uint64_t kilobytes = 0;
  std::string unit;
  while (file >> name >> kilobytes) {
    std::getline(file, unit);
    if (name == "MemAvailable:") {
      return kilobytes * 1024U;
    }
  }
  return 1024 * kMiB;
}

/// Nothing where the file holds no number ("max") or isn't there.
std::optional<std::uint64_t> number_in(const std::string& path) {
  std::ifstream file(path);
  std::uint64_t value = 0;
  return file >> value ? std::optional(value) : std::nullopt;
}

/// What one group still grants. The page cache that it holds can be taken back.
std::uint64_t left_in_group(const std::string& folder, const char* limit, const char* usage,
                            const char* cache) {
  const auto most = number_in(folder + limit);
  if (!most) {
    return kUnlimited;
  }
  std::uint64_t used = number_in(folder + usage).value_or(0);
  std::ifstream stat(folder + "/memory.stat");
  std::string name;
  std::uint64_t bytes = 0;
  while (stat >> name >> bytes) {
    if (name == cache) {
      used -= std::min(used, bytes);
    }
  }
  return *most > used ? *most - used : 0;
}

std::uint64_t left_in_groups(const std::string& root) {
  std::uint64_t least = kUnlimited;
  std::ifstream own(root + "/proc/self/cgroup");
  std::string line;
  while (std::getline(own, line)) {
    const std::size_t colon = line.find(':');
    const std::size_t second = line.find(':', colon + 1);
    if (colon == std::string::npos || second == std::string::npos) {
      continue;
    }
    const std::string controllers = line.substr(colon + 1, second - colon - 1);
    const bool unified = controllers.empty();
    if (!unified && controllers != "memory") {
      continue;
    }
    const std::string base = root + (unified ? "/sys/fs/cgroup" : "/sys/fs/cgroup/memory");
    std::string group = line.substr(second + 1);
    for (;;) {
      const std::string folder = base + (group == "/" ? "" : group);
      least =
          std::min(least, unified ? left_in_group(folder, "/memory.max", "/memory.current", "file")
                                  : left_in_group(folder, "/memory.limit_in_bytes",
                                                  "/memory.usage_in_bytes", "total_cache"));
      if (group.empty() || group == "/") {
        break;
      }
      group.resize(group.rfind('/') == std::string::npos ? 0 : group.rfind('/'));
    }
  }
  return least;
}

std::uint64_t granted_by_slurm(const MemorySources& sources) {
  const auto value = [&](const char* name) -> std::uint64_t {
    const char* text = sources.environment(name);
    return text == nullptr ? 0 : std::strtoull(text, nullptr, 10);
  };
  std::uint64_t mebibytes = value("SLURM_MEM_PER_NODE");
  if (mebibytes == 0) {
    mebibytes = value("SLURM_MEM_PER_CPU") * value("SLURM_CPUS_ON_NODE");
  }
  return mebibytes == 0 || mebibytes > kUnlimited / kMiB ? kUnlimited : mebibytes * kMiB;
}

}  // namespace

std::uint64_t granted_memory(const MemorySources& sources) {
  return std::min(
      {free_bytes(sources.root), left_in_groups(sources.root), granted_by_slurm(sources)});
}

std::uint64_t default_memory_share() {
  const MemorySources machine{"", [](const char* name) { return std::getenv(name); }};
  return std::max(granted_memory(machine) / 2, 256 * kMiB);
}

}  // namespace rattan
