// SPDX-License-Identifier: MIT
#pragma once

#include "engine/mesh/tile_mesh.h"
#include "jobs/report.h"

namespace rattan {

struct LayoutReport;

/// Told by remesh_scan and layout_scan what they have done so far, in order and one at a time.
/// Where saved work had to be dropped, a stage may come twice.
class JobEvents {
 public:
  virtual ~JobEvents() = default;
  /// The scan is in tiles; within the stage "ingest".
  virtual void scan_read(const ScanTopology& scan) = 0;
  /// A stage ended well. What an earlier run did of it comes first, marked as resumed.
  virtual void stage_ended(const StageRecord& stage) = 0;
  /// One size is done and its file in place.
  virtual void output_written(const RemeshReport::Finished& finished) = 0;
  /// A layout is done and all its files in place.
  virtual void layout_written(const LayoutReport& report) = 0;
};

}  // namespace rattan
