// SPDX-License-Identifier: MIT
#include "jobs/memory_share.h"

#include <algorithm>
#include <fstream>
#include <string>

namespace rattan {

namespace {

std::uint64_t available_bytes() {
  std::ifstream file("/proc/meminfo");
  std::string name;
  std::uint64_t kilobytes = 0;
  std::string unit;
  while (file >> name >> kilobytes) {
    std::getline(file, unit);
    if (name == "MemAvailable:") {
      return kilobytes * 1024U;
    }
  }
  return std::uint64_t{1} << 30U;
}

/// Limit of this process's control group (version 2), or the largest number where there is none.
std::uint64_t group_limit_bytes() {
  std::ifstream own("/proc/self/cgroup");
  std::string line;
  while (std::getline(own, line)) {
    if (line.rfind("0::", 0) == 0) {
      std::ifstream limit("/sys/fs/cgroup" + line.substr(3) + "/memory.max");
      std::uint64_t bytes = 0;
      if (limit >> bytes) {
        return bytes;
      }
    }
  }
  return ~std::uint64_t{0};
}

}  // namespace

std::uint64_t default_memory_share() {
  const std::uint64_t free = std::min(available_bytes(), group_limit_bytes());
  return std::max<std::uint64_t>(free / 2, std::uint64_t{256} << 20U);
}

}  // namespace rattan
