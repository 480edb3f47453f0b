// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <mutex>
#include <string>
#include <vector>

#include "engine/core/progress.h"

namespace rattan {

enum class Verbosity { kQuiet, kNormal, kVerbose };

/// Progress for people: one line a stage, redrawn in place on a terminal with rate and time left;
/// off a terminal one plain line when a stage ends. Warnings go to stderr and are kept.
class Console final : public ProgressSink {
 public:
  explicit Console(Verbosity verbosity);
  ~Console() override;

  void progress(std::string_view stage, std::uint64_t done, std::uint64_t total) override;
  void warning(const std::string& sentence) override;

 private:
  using Clock = std::chrono::steady_clock;

  void finish_line();

  Verbosity verbosity_;
  bool terminal_;
  std::mutex mutex_;
  std::string stage_;
  std::uint64_t done_ = 0;
  std::uint64_t total_ = 0;
  Clock::time_point stage_start_;
  Clock::time_point last_draw_;
  bool line_open_ = false;
};

}  // namespace rattan
