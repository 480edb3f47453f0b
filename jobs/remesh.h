// SPDX-License-Identifier: MIT
#pragma once

// Rattan for other programs, installed as <rattan/remesh.h>: one scan in, one or several verified
// remeshes out, the same bytes as from `rattan remesh`. This header and those it includes need the
// standard library alone.
//
//   rattan::RemeshOptions options;
//   options.scan = "bust.ply";
//   options.output = "bust.drc";
//   rattan::NullProgress progress;
//   const rattan::RemeshResult result = rattan::remesh(options, progress);

#include <cstdint>
#include <string>
#include <vector>

#include "engine/core/errors.h"
#include "engine/core/progress.h"
#include "jobs/remesh_options.h"
#include "jobs/stop_requests.h"

namespace rattan {

/// One remesh that was written and verified.
struct WrittenRemesh {
  std::string path;
  std::uint64_t bytes = 0;
  std::uint64_t vertices = 0;
  std::uint64_t faces = 0;
  std::uint64_t quads = 0;
  std::uint64_t triangles = 0;
  std::uint64_t irregular_vertices = 0;  ///< interior, valence other than 4
  /// False where the scan's topology and relief didn't allow the size that was asked for; then
  /// there is a warning too.
  bool target_met = false;
  double distance_rms = 0.0;  ///< from the scan to the remesh, in the file's units
};

struct RemeshResult {
  std::vector<WrittenRemesh> outputs;  ///< one a size, in the order of RemeshOptions::sizes
  std::vector<std::string> warnings;
  double seconds = 0.0;
  std::uint64_t peak_rss_bytes = 0;  ///< of the whole process
  /// All that is known about the run: JSON, as `rattan remesh --report` writes it. Its names are
  /// stable.
  std::string report;
};

/// The whole run. Blocks; `progress` is called from several threads at once. One run at a time in a
/// process: `options.memory` bounds the resident set of the process, which should be linked with
/// jemalloc where that bound is tight. After an exception other than UsageError and InputError the
/// same call goes on from what the work directory holds.
///
/// Throws UsageError (an option out of range, an output of unknown format), InputError (the scan,
/// or a folder, can't be used), ResourceError (memory or disk are too small, or another process
/// works on this output), Cancelled (a stop was requested; the work is saved), InternalError (a
/// defect in Rattan) and std::bad_alloc. No output file is left half written by any of them.
RemeshResult remesh(const RemeshOptions& options, ProgressSink& progress,
                    const StopRequests& stop = {});

/// Of the library, e.g. "0.1.0".
const char* library_version();

}  // namespace rattan
