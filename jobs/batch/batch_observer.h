// SPDX-License-Identifier: MIT
#pragma once

// Who wants to know what a batch does: the console, the JSON log, metrics. All are called on the
// batch's only thread, and shall return at once.

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "jobs/batch/batch_item.h"
#include "jobs/batch/journal.h"

namespace rattan {

/// One attempt at a scan.
struct Attempt {
  int number = 0;        ///< from 1, over all runs
  int pid = 0;           ///< of the child; 0: there was no need of one
  double started = 0.0;  ///< seconds since 1970
  int threads = 0;
  std::uint64_t memory = 0;
  double cost = 0.0;       ///< cpu seconds forecast
  double triangles = 0.0;  ///< forecast
  std::vector<std::string> command;

  // Known at its end.
  int exit = 0;          ///< class: 0, 1, 2, 3, 4 or 75
  int signal = 0;        ///< that ended the child
  bool adopted = false;  ///< finished by an earlier process
  std::string sentence;
  double seconds = 0.0;
  double cpu_seconds = 0.0;
  std::uint64_t peak_rss_bytes = 0;
  std::vector<OutputFile> outputs;
  std::uint64_t warnings = 0;
  std::string log;  ///< path of the log file; empty: none
};

struct BatchState {
  std::uint64_t items = 0;          ///< all of the batch
  std::uint64_t before = 0;         ///< done before it began, or by others since
  std::uint64_t failed_before = 0;  ///< failed for good before it began
  std::uint64_t done = 0;           ///< by this process
  std::uint64_t unusable = 0;       ///< by this process, exit 3 or 2
  std::uint64_t resource = 0;       ///< exit 4
  std::uint64_t defect = 0;         ///< exit 1
  std::uint64_t interrupted = 0;
  std::uint64_t running = 0;
  std::uint64_t elsewhere = 0;  ///< in the hands of other processes
  std::uint64_t pending = 0;

  int threads = 0;
  int threads_used = 0;
  std::uint64_t memory = 0;
  std::uint64_t memory_used = 0;  ///< granted to children

  double seconds = 0.0;      ///< since the batch began
  double cpu_seconds = 0.0;  ///< of children that ended, and of the batch itself
  double cost_done = 0.0;    ///< forecast cpu seconds of what was finished
  double cost_left = 0.0;
  double triangles_done = 0.0;
  double seconds_left = -1.0;  ///< below 0: not known yet
  bool stopping = false;
};

class BatchObserver {
 public:
  virtual ~BatchObserver() = default;
  virtual void begun(const BatchState&) {}
  /// A child was started.
  virtual void started(const BatchItem&, const Attempt&) {}
  /// A line of its JSON log.
  virtual void line(const BatchItem&, const Attempt&, const nlohmann::json&) {}
  virtual void ended(const BatchItem&, const Attempt&) {}
  /// A sentence for the user about the batch itself.
  virtual void warning(const std::string&) {}
  /// Once a second.
  virtual void tick(const BatchState&) {}
  virtual void finished(const BatchState&, int /*exit_code*/) {}
};

}  // namespace rattan
