// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "jobs/batch/batch_item.h"
#include "jobs/batch/batch_observer.h"
#include "jobs/batch/forecast.h"

namespace rattan {

struct BatchRunOptions {
  std::string directory;  ///< made if it isn't there
  int threads = 0;        ///< of all scans together; 0: every processor the process may run on
  /// Bytes of all processes together, this one included; 0: half of what the machine grants.
  std::uint64_t memory = 0;
  int jobs = 0;  ///< most scans at once; 0: as threads and memory allow
  bool retry_failed = false;
  bool fresh = false;   ///< do what is done again, too
  bool report = true;   ///< thumbnails and 3D views for the page
  std::string program;  ///< to run instead of this one; for tests
  /// Folder of the work directories, <id>.work in it; empty: beside the outputs.
  std::string work_directory;

  std::uint64_t total = 0;  ///< items of the whole selection; 0: as many as were given
  std::uint32_t shard = 0;  ///< from 1, told in the journal; 0: none
  std::uint32_t shards = 0;

  std::vector<BatchObserver*> observers;  ///< not owned
};

/// Why an item is to be done, or why not.
enum class Standing : std::uint8_t {
  kNew,
  kScanChanged,
  kOptionsChanged,
  kRattanChanged,  ///< failed with another version
  kOutputMissing,  ///< or of another size than was written
  kUnfinished,     ///< interrupted, or nobody knows how it ended
  kRetry,          ///< failed for want of memory or disk, or asked for by retry_failed
  kFresh,
  kDone,
  kFailed,  ///< and nothing changed since
};
/// Whether a run would do it.
inline bool to_do(Standing standing) {
  return standing != Standing::kDone && standing != Standing::kFailed;
}
/// In words, e.g. "options changed".
const char* describe(Standing standing);

/// What run_batch would do with each item, from the journal; `--dry-run`. Writes nothing.
std::vector<Standing> plan_batch(const std::vector<BatchItem>& items,
                                 const BatchRunOptions& options);

/// Makes every output that is missing or out of date, each in a child process, and returns the
/// batch's exit code: 75 if it was interrupted with work left, else 1, 4, 3 or 0, whatever is the
/// worst of all items, also of those that failed before. No two items may have one id. Takes over
/// SIGTERM, SIGINT, SIGUSR1 and SIGCHLD while it runs; to be called on the only thread. Throws
/// ResourceError where the directory can't be written to.
int run_batch(const std::vector<BatchItem>& items, const BatchRunOptions& options);

}  // namespace rattan
