// SPDX-License-Identifier: MIT
#pragma once

// What a work directory says beside the fields of the stages: enough to draw every panel again
// without the scan's file.

#include <optional>
#include <string_view>

#include "engine/core/store.h"
#include "engine/layout/flat_layout.h"
#include "engine/remesh/polygon_mesh.h"

namespace rattan {

/// The store's note of the options that its fields were made with, as text.
inline constexpr const char* kOptionsNote = "options";

/// Chunks of what a layout's work holds in memory: ChartLayout, FlatLayout.
inline constexpr std::string_view kCharts = "layout/charts";
inline constexpr std::string_view kFlatLayout = "layout/flat_layout";

struct ChartRecord {
  ChartLayout layout;
  FlatLayout flat;
};

struct WorkRecord {
  double omega = 0.0;  ///< period of the phases, scan units; 0 before there are phases
  int density = 2;     ///< iso-lines a period
  std::optional<PolygonMesh> remesh;  ///< positions relative to the scan's origin
  std::optional<ChartRecord> charts;  ///< parameterized
};

void save_lines(Store& store, double omega, int density);
/// As far as the work came. The scan itself: load_scan_mesh. The remesh: working_mesh.h.
WorkRecord load_work(Store& store);

}  // namespace rattan
