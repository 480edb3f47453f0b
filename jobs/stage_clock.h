// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "engine/core/task_graph.h"
#include "jobs/report.h"

namespace rattan {

/// Measures stages: wall and processor time, passes, bytes moved by the store.
class StageClock {
 public:
  struct StoreTraffic {
    std::uint64_t bytes_read = 0;
    std::uint64_t bytes_written = 0;
  };

  StageClock(const TaskGraph& tasks, std::function<StoreTraffic()> traffic,
             std::vector<StageRecord>& records)
      : tasks_(tasks), traffic_(std::move(traffic)), records_(records) {}

  /// Runs `work` as the stage `name` and appends its record.
  template <class Work>
  decltype(auto) run(const std::string& name, Work&& work) {
    const Running running(*this, name);
    return work();
  }

 private:
  class Running {
   public:
    Running(StageClock& clock, std::string name);
    ~Running();
    Running(const Running&) = delete;
    Running& operator=(const Running&) = delete;

   private:
    StageClock& clock_;
    std::string name_;
    double wall_;
    double cpu_;
    std::uint64_t passes_;
    StoreTraffic traffic_;
  };

  const TaskGraph& tasks_;
  std::function<StoreTraffic()> traffic_;
  std::vector<StageRecord>& records_;
};

/// Seconds of a steady clock; of this process's processor time; bytes of peak resident memory.
double wall_seconds();
double cpu_seconds();
std::uint64_t peak_rss_bytes();

}  // namespace rattan
