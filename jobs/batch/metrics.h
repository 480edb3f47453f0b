// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "jobs/batch/batch_observer.h"

namespace rattan {

/// A batch as a file in Prometheus' text format, for the textfile collector of node_exporter. The
/// file is replaced as a whole every second and at the end, and never seen half written. What
/// it counts is of this process; `labels` stand on every sample, so that files of several batches
/// or shards can be collected side by side.
class BatchMetrics final : public BatchObserver {
 public:
  using Labels = std::vector<std::pair<std::string, std::string>>;

  /// Throws ResourceError where the file can't be written. Later failures are only counted: metrics
  /// stop no batch.
  BatchMetrics(std::string path, Labels labels);

  void begun(const BatchState& state) override;
  void started(const BatchItem& item, const Attempt& attempt) override;
  void line(const BatchItem& item, const Attempt& attempt, const nlohmann::json& event) override;
  void ended(const BatchItem& item, const Attempt& attempt) override;
  void warning(const std::string& sentence) override;
  void tick(const BatchState& state) override;
  void finished(const BatchState& state, int exit_code) override;

  /// The file's contents.
  std::string text() const;

 private:
  using Clock = std::chrono::steady_clock;

  /// Of one attempt, until it ends.
  struct Running {
    std::uint64_t triangles = 0;
    std::uint64_t faces = 0;
    std::uint64_t quads = 0;
  };
  struct Stage {
    double seconds = 0.0;
    double cpu_seconds = 0.0;
    std::uint64_t bytes_moved = 0;
    std::uint64_t bytes_read = 0;
    std::uint64_t bytes_written = 0;
  };
  /// Upper bounds of the histogram of seconds a scan.
  static constexpr std::array<double, 11> kBounds = {0.1, 0.3, 1,    3,    10,   30,
                                                     100, 300, 1000, 3000, 10000};

  bool write();

  std::string path_;
  Labels labels_;
  BatchState state_;
  double start_time_;  ///< seconds since 1970
  Clock::time_point last_write_;
  int exit_code_ = -1;  ///< once finished

  std::map<std::string, Running> running_;  ///< by item
  std::map<int, std::uint64_t> attempts_;   ///< by exit code
  std::map<std::string, Stage> stages_;
  std::uint64_t triangles_ = 0;
  std::uint64_t faces_ = 0;
  std::uint64_t quads_ = 0;
  std::uint64_t input_bytes_ = 0;
  std::uint64_t output_bytes_ = 0;
  std::uint64_t warnings_ = 0;
  std::uint64_t failed_writes_ = 0;
  std::uint64_t peak_rss_bytes_ = 0;
  double scan_seconds_ = 0.0;
  double scan_cpu_seconds_ = 0.0;
  std::array<std::uint64_t, kBounds.size() + 1> durations_{};  ///< the last: longer than all bounds
};

}  // namespace rattan
