// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>

#include <CLI/CLI.hpp>
#include <nlohmann/json_fwd.hpp>

#include "engine/core/progress.h"
#include "jobs/job_events.h"
#include "jobs/remesh_options.h"
#include "jobs/remesh_plan.h"

namespace rattan {

/// What happens, for programs: a JSON object a line, each written at once. All have "time" (UTC),
/// "event" and "scan"; bytes of a file name that are no UTF-8 become U+FFFD.
class JsonLog final : public ProgressSink, public JobEvents {
 public:
  /// Writes to the open file `fd`, which stays the caller's.
  explicit JsonLog(int fd);

  void set_scan(std::string scan) { scan_ = std::move(scan); }
  /// Without "progress".
  void set_quiet(bool quiet) { quiet_ = quiet; }

  void start(const ScanOptions& options);
  /// At most one line a second.
  void progress(std::string_view stage, std::uint64_t done, std::uint64_t total) override;
  void warning(const std::string& sentence) override;
  void scan_read(const ScanTopology& scan) override;
  void stage_ended(const StageRecord& stage) override;
  void output_written(const RemeshReport::Finished& finished) override;
  void layout_written(const LayoutReport& report) override;
  void plan(const RemeshPlan& plan);
  /// A request to stop was heard.
  void stopping(const std::string& sentence);
  /// What ended the command, and the end.
  void error(const std::string& sentence, int exit);
  void end(int exit);

  /// A line of another kind: what all have, to be added to and written.
  nlohmann::ordered_json event(const char* name) const;
  void write(const nlohmann::ordered_json& line);

 private:
  using Clock = std::chrono::steady_clock;

  int fd_;
  std::string scan_;
  bool quiet_ = false;
  double start_;
  ScanTopology read_;  ///< of the scan, once that is known
  std::timed_mutex mutex_;
  std::mutex progress_mutex_;
  Clock::time_point last_progress_;
};

/// "2026-11-22T17:20:01.123Z".
std::string utc_now();

/// Adds --log-format, which main reads before anything is parsed, as errors of the command line are
/// events too.
void add_log_format_option(CLI::App& command);
bool json_log_wanted(int argc, const char* const* argv);

}  // namespace rattan
