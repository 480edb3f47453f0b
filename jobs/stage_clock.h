// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "engine/core/task_graph.h"
#include "jobs/report.h"

namespace rattan {

/// Measures stages: wall and processor time, passes, bytes moved by the store. A stage of which an
/// earlier run did a part has two records, the first for that part.
class StageClock {
 public:
  struct StoreTraffic {
    std::uint64_t bytes_read = 0;
    std::uint64_t bytes_written = 0;
    std::uint64_t bytes_moved = 0;
  };

  /// `ended` is told of each record of a stage that ended without an exception; may be empty.
  StageClock(const TaskGraph& tasks, std::function<StoreTraffic()> traffic,
             std::vector<StageRecord>& records, std::function<void(const StageRecord&)> ended = {})
      : tasks_(tasks), traffic_(std::move(traffic)), records_(records), ended_(std::move(ended)) {}

  /// What was measured since the last call, or since the stage began; inside `work` of run.
  StageRecord lap();
  /// A part of this stage was done by an earlier run, at this cost.
  void pass_over(const StageRecord& cost);

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
    StageRecord begun_;
    int exceptions_;  ///< in flight when it began
  };

  StageRecord totals() const;

  const TaskGraph& tasks_;
  std::function<StoreTraffic()> traffic_;
  std::vector<StageRecord>& records_;
  std::function<void(const StageRecord&)> ended_;
  StageRecord last_;         ///< totals at the last lap
  StageRecord passed_over_;  ///< of the stage that runs
  bool any_passed_over_ = false;
  bool any_done_ = false;
};

/// Seconds of a steady clock; of this process's processor time; bytes of peak resident memory.
double wall_seconds();
double cpu_seconds();
std::uint64_t peak_rss_bytes();

}  // namespace rattan
