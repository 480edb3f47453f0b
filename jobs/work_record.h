// SPDX-License-Identifier: MIT
#pragma once

// What a kept work directory says beside the fields of the stages: enough to draw every panel again
// without the scan's file.

#include <optional>

#include "engine/mesh/tile_mesh.h"
#include "engine/remesh/polygon_mesh.h"
#include "io/store/hdf5_store.h"

namespace rattan {

struct WorkRecord {
  double omega = 0.0;  ///< period of the phases, scan units; 0 before there are phases
  int density = 2;     ///< iso-lines a period
  std::optional<PolygonMesh> remesh;  ///< positions relative to the scan's origin
};

/// Completes the stages "param" and "remesh" of a store that keeps its stages.
void save_work(Hdf5Store& store, const PolygonMesh& remesh, double omega, int density);
/// As far as the work came. The scan itself: load_scan_mesh.
WorkRecord load_work(Hdf5Store& store);

}  // namespace rattan
