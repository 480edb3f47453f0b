// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <string>

#include "jobs/batch/batch_observer.h"
#include "tools/rattan/json_log.h"

namespace rattan {

/// A batch for programs: the events of each run with the scan's "id" added, and "batch_start",
/// "scan_start", "scan_end", "batch_progress" (at most one in five seconds) and "batch_end".
class BatchJsonLog final : public BatchObserver {
 public:
  /// `directory`: the batch's. `quiet`: without progress.
  BatchJsonLog(JsonLog& log, std::string directory, bool quiet);

  void begun(const BatchState& state) override;
  void started(const BatchItem& item, const Attempt& attempt) override;
  void line(const BatchItem& item, const Attempt& attempt, const nlohmann::json& event) override;
  void ended(const BatchItem& item, const Attempt& attempt) override;
  void warning(const std::string& sentence) override;
  void tick(const BatchState& state) override;
  void finished(const BatchState& state, int exit_code) override;

 private:
  using Clock = std::chrono::steady_clock;

  nlohmann::ordered_json item_event(const char* name, const BatchItem& item,
                                    const Attempt& attempt) const;

  JsonLog& log_;
  std::string directory_;
  bool quiet_;
  Clock::time_point last_progress_;
};

}  // namespace rattan
