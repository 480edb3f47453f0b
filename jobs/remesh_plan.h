// SPDX-License-Identifier: MIT
#pragma once

// What a run would take, told without running it: --dry-run.

#include <cstdint>
#include <string>

#include "engine/core/progress.h"
#include "jobs/layout_options.h"
#include "jobs/remesh_options.h"

namespace rattan {

struct RemeshPlan {
  std::string scan;
  std::string format;
  std::uint64_t file_bytes = 0;
  std::uint64_t vertices = 0;   ///< after welding a soup: estimated there
  std::uint64_t triangles = 0;  ///< in the file, polygons cut
  double faces = 0.0;           ///< of the largest remesh; 0: the area decides
  bool layout = false;          ///< charts instead of faces
  double charts = 0.0;          ///< 0: the area decides
  std::uint64_t tiles = 0;
  std::uint64_t least_budget = 0;
  std::uint64_t budget = 0;
  std::uint64_t whole_scan = 0;  ///< bytes with which no intermediate data leave memory
  std::string work_directory;
  std::uint64_t disk = 0;       ///< bytes of work at most, about
  std::uint64_t disk_free = 0;  ///< 0: unknown
  int passes = 0;               ///< over the scan, for each size; about
  int threads = 0;
  double seconds = 0.0;  ///< about

  bool fits() const { return least_budget <= budget && (disk_free == 0 || disk <= disk_free); }
};

/// Reads the scan's file once and writes nothing. Throws what read_scan throws.
RemeshPlan plan_remesh(const RemeshOptions& options, ProgressSink& progress);

RemeshPlan plan_layout(const LayoutOptions& options, ProgressSink& progress);

/// A line for each thing, for people.
std::string describe(const RemeshPlan& plan);

}  // namespace rattan
