// SPDX-License-Identifier: MIT
#pragma once

// What all jobs on one scan share: the budget, the store, steps that can be taken up again, and
// reading the scan into tiles. A job is one attempt: all its stages in order, from wherever saved
// work takes it up.

#include <limits>
#include <string>
#include <vector>

#include <oneapi/tbb/global_control.h>

#include "engine/core/memory_budget.h"
#include "engine/core/progress.h"
#include "engine/core/task_graph.h"
#include "engine/mesh/ingest.h"
#include "engine/mesh/tile_mesh.h"
#include "io/store/hdf5_store.h"
#include "io/store/work_lock.h"
#include "jobs/job_events.h"
#include "jobs/job_steps.h"
#include "jobs/report.h"
#include "jobs/scan_options.h"
#include "jobs/stage_clock.h"
#include "jobs/stop_requests.h"

namespace rattan {

/// Keeps the warnings for the report on their way to the caller.
class RecordingProgress final : public ProgressSink {
 public:
  RecordingProgress(ProgressSink& next, std::vector<std::string>& warnings)
      : next_(next), warnings_(warnings) {}
  void progress(std::string_view stage, std::uint64_t done, std::uint64_t total) override {
    next_.progress(stage, done, total);
  }
  void warning(const std::string& sentence) override {
    warnings_.push_back(sentence);
    next_.warning(sentence);
  }

 private:
  ProgressSink& next_;
  std::vector<std::string>& warnings_;
};

/// Where a job runs and who is told.
struct JobPlace {
  std::string work_directory;
  const WorkLock& lock;
  ProgressSink& progress;
  const StopRequests& stop;
  JobEvents* events = nullptr;
};

/// What an attempt takes over from those before.
struct JobAttempt {
  bool fresh = false;
  std::size_t most_steps = std::numeric_limits<std::size_t>::max();
  std::vector<std::string> warnings;
  double start = 0.0;
};

class ScanJob {
 public:
  ScanJob(const ScanJob&) = delete;
  ScanJob& operator=(const ScanJob&) = delete;
  const std::vector<std::string>& warnings() const { return record_.warnings; }

 protected:
  /// `options` and what `place` refers to outlive the job.
  ScanJob(const ScanOptions& options, const JobPlace& place, const JobAttempt& attempt);
  ~ScanJob() = default;

  /// Fills record_.input too.
  ScanMesh ingest();
  /// Figures of the whole run; call last.
  void finish_record();

  RunRecord record_;
  JobEvents* events_;  ///< may be null
  double start_;
  RecordingProgress progress_;
  int threads_;
  oneapi::tbb::global_control parallelism_;
  std::uint64_t memory_;
  MemoryBudget budget_;
  Reservation process_memory_;
  Reservation scan_memory_;
  Hdf5Store store_;
  JobSteps steps_;
  TaskGraph tasks_;
  StageClock clock_;
  std::string field_hash_;  ///< of the file of directions; empty: none

 private:
  IngestOptions ingest_options();

  const ScanOptions& scan_options_;
};

/// Removes the file and says so; throws ResourceError if it happens again and again.
std::string after_damage(const DamagedFile& damage, int damages, ProgressSink& progress);
std::string how_to_resume(const Cancelled& e);

/// Throws InputError unless the folder that the file is to be written to exists.
void check_folder(const std::string& output);

/// Runs Job(options, place, attempt).run() as long as saved work turns out not to fit or to be
/// damaged, with what is left of it.
template <class Job, class Options>
auto run_attempts(const Options& options, const JobPlace& place) {
  JobAttempt attempt{.fresh = options.fresh, .warnings = {}, .start = wall_seconds()};
  for (int damages = 0;;) {
    Job job(options, place, attempt);
    attempt.fresh = false;
    attempt.most_steps = std::numeric_limits<std::size_t>::max();
    try {
      return job.run();
    } catch (const Rewind& rewind) {
      attempt.most_steps = rewind.steps;
      attempt.warnings = job.warnings();
    } catch (const DamagedFile& damage) {
      attempt.warnings = job.warnings();
      attempt.warnings.push_back(after_damage(damage, ++damages, place.progress));
    }
  }
}

/// With the lock of the work directory (`output`.work unless given) held, runs the job; what is
/// said when it was interrupted tells how to go on.
template <class Job, class Report, class Options>
Report run_scan_job(const Options& options, const std::string& output, ProgressSink& progress,
                    const StopRequests& stop, JobEvents* events) {
  const std::string directory = options.work_dir.empty() ? output + ".work" : options.work_dir;
  const WorkLock lock(directory);
  try {
    return run_attempts<Job>(options, {directory, lock, progress, stop, events});
  } catch (const Cancelled& e) {
    throw Cancelled(how_to_resume(e));
  }
}

}  // namespace rattan
