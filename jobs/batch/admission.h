// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "jobs/batch/forecast.h"

namespace rattan {

/// Decides what runs beside what: within so many threads, bytes and scans at once, the largest
/// first. Knows no clock, file or process: times are handed in, in any unit-of-seconds clock.
///
/// A scan gets one thread, as many scans side by side use processors best; one that alone is more
/// than its share of what is left gets more, up to all. Memory is divided evenly between what can
/// start, between what a scan needs at least and what it can use. When the largest doesn't fit
/// beside what runs, smaller ones go first only if that doesn't delay it.
class Admission {
 public:
  struct Limits {
    int threads = 1;
    std::uint64_t memory = 0;
    int jobs = 0;  ///< 0: no limit
  };
  struct Task {
    Forecast forecast;
    int threads = 0;           ///< 0: to be decided
    std::uint64_t memory = 0;  ///< likewise
  };
  struct Grant {
    std::size_t task = 0;
    int threads = 0;
    std::uint64_t memory = 0;
  };

  explicit Admission(const Limits& limits) : limits_(limits) {}

  /// All at once. Ties are broken by position.
  void set_tasks(std::vector<Task> tasks);
  /// Puts a task that was granted back to the end of the queue; with `alone` it will get all that
  /// there is.
  void put_back(std::size_t task, bool alone);

  /// Whether it could run with everything that there is.
  bool possible(std::size_t task) const { return need(task) <= limits_.memory; }
  /// What is to start now, if anything; it counts as running then. Impossible tasks get what there
  /// is.
  std::optional<Grant> next(double now);
  void ended(std::size_t task);
  /// A granted task will not run after all: others have it. It is not put back.
  void drop(std::size_t task) { ended(task); }

  std::size_t waiting() const { return waiting_; }
  std::size_t running() const { return running_.size(); }
  int threads_used() const { return threads_used_; }
  std::uint64_t memory_used() const { return memory_used_; }
  double cost_waiting() const { return cost_waiting_; }
  const Task& task(std::size_t task) const { return tasks_[task]; }
  /// How long things really take, in multiples of what was foreseen.
  void set_pace(double pace) { pace_ = pace; }

 private:
  struct Running {
    std::size_t task = 0;
    int threads = 0;
    std::uint64_t memory = 0;
    double end = 0.0;  ///< foreseen
  };
  struct Wish {
    int threads = 1;
    std::uint64_t least = 0;
  };
  /// When the wish can be granted, and what is left over then.
  struct Opening {
    double time = 0.0;
    int threads = 0;
    std::uint64_t memory = 0;
  };

  std::uint64_t need(std::size_t task) const;
  Wish wish(std::size_t task, double now) const;
  bool fits(const Wish& wish) const;
  Opening opening(const Wish& wish, double now) const;
  double duration(std::size_t task, int threads) const;
  Grant grant(std::size_t task, const Wish& wish, double now);
  bool is_waiting(std::size_t task) const { return state_[task] == State::kWaiting; }

  enum class State : std::uint8_t { kWaiting, kAgain, kTaken };

  Limits limits_;
  std::vector<Task> tasks_;
  std::vector<std::uint32_t> queue_;  ///< largest first
  std::size_t head_ = 0;              ///< nothing before it waits
  std::vector<std::uint32_t> again_;  ///< put back
  std::vector<State> state_;
  std::vector<bool> alone_;
  std::vector<Running> running_;
  std::size_t waiting_ = 0;
  int threads_used_ = 0;
  std::uint64_t memory_used_ = 0;
  double cost_waiting_ = 0.0;
  double pace_ = 1.0;
};

}  // namespace rattan
