// SPDX-License-Identifier: MIT
#include "jobs/stage_clock.h"

#include <chrono>
#include <sys/resource.h>
#include <utility>

namespace rattan {

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

std::uint64_t peak_rss_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024U;
}

StageClock::Running::Running(StageClock& clock, std::string name)
    : clock_(clock),
      name_(std::move(name)),
      wall_(wall_seconds()),
      cpu_(cpu_seconds()),
      passes_(clock.tasks_.passes()),
      traffic_(clock.traffic_()) {}

StageClock::Running::~Running() {
  const StoreTraffic now = clock_.traffic_();
  clock_.records_.push_back({.name = name_,
                             .seconds = wall_seconds() - wall_,
                             .cpu_seconds = cpu_seconds() - cpu_,
                             .passes = clock_.tasks_.passes() - passes_,
                             .bytes_read = now.bytes_read - traffic_.bytes_read,
                             .bytes_written = now.bytes_written - traffic_.bytes_written,
                             .resumed = false});
}

}  // namespace rattan
