// SPDX-License-Identifier: MIT
#pragma once

// The fields of a kept work directory, or of an interrupted run, as a file for ParaView and VTK.

#include <cstdint>
#include <stop_token>
#include <string>
#include <vector>

#include "engine/core/progress.h"

namespace rattan {

struct ExportOptions {
  std::string work;          ///< directory
  std::string output;        ///< .vtkhdf or .hdf
  std::uint64_t memory = 0;  ///< bytes; 0 takes half of what the machine has available
  int threads = 0;           ///< 0 uses every processor that the process may run on
};

struct ExportSummary {
  std::uint64_t points = 0;
  std::uint64_t triangles = 0;
  std::uint64_t bytes = 0;           ///< of the file
  std::vector<std::string> missing;  ///< what the work hasn't come to, in words
};

/// Writes what README.md lists, as far as the work came. Reads the directory tile by tile and
/// changes nothing in it. The file's bytes depend on the work alone. Throws UsageError for an
/// output of another format, InputError for what is no work directory or is damaged, ResourceError
/// where another process is at work there or memory or disk run out, Cancelled.
ExportSummary export_work(const ExportOptions& options, ProgressSink& progress,
                          const std::stop_token& stop = {});

}  // namespace rattan
