// SPDX-License-Identifier: MIT
#pragma once

// One tile of an export: what the store holds of it, turned into rows of arrays.

#include <memory>
#include <optional>

#include "engine/core/task_graph.h"
#include "engine/mesh/features.h"
#include "engine/mesh/tile_mesh.h"
#include "engine/param/solution_record.h"
#include "engine/param/triangle_coordinates.h"
#include "io/export/vtkhdf_writer.h"

namespace rattan {

/// What the work has come to.
struct WorkContents {
  ScanMesh scan;
  bool geometry = false;  ///< low-passed positions, normals, curvature
  bool wanted = false;    ///< directions that came with the scan
  bool colours = false;
  std::optional<FieldRecord> field;
  std::optional<PhaseRecord> phase;  ///< only where there is a field
  bool norms = false;
  bool charts = false;
  FeatureSet features;

  static WorkContents of(Store& store);
};

/// Sums over the scan, in tile order.
struct ExportSums {
  SingularityCounts singularities;
  double edge_energy = 0.0;
  double pin_energy = 0.0;
};

/// Declares the arrays that there are data for, and makes the tasks that fill them. All that is
/// given must outlive it.
class TileExporter {
 public:
  TileExporter(Store& store, const WorkContents& work, VtkHdfWriter& file);
  ~TileExporter();
  TileExporter(const TileExporter&) = delete;
  TileExporter& operator=(const TileExporter&) = delete;

  std::unique_ptr<TileTask> task(TileId id);
  const ExportSums& sums() const { return sums_; }

 private:
  class Task;
  struct Arrays;
  Store& store_;
  const WorkContents& work_;
  VtkHdfWriter& file_;
  std::unique_ptr<const Arrays> arrays_;
  ExportSums sums_;
};

}  // namespace rattan
