// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "engine/core/store.h"
#include "engine/core/task_graph.h"
#include "engine/layout/flat_layout.h"
#include "engine/mesh/tile_mesh.h"
#include "engine/remesh/polygon_mesh.h"
#include "io/picture/render.h"

namespace rattan {

/// What the picture shows; the store holds the scan and, as far as the job came, the field before
/// and after smoothing and the phases.
struct PreviewInput {
  Store& store;
  const ScanMesh& scan;
  const PolygonMesh* remesh = nullptr;  ///< may be null
  /// Null but for a layout, whose charts the store holds as flatten_layout left them.
  const ChartLayout* charts = nullptr;
  const FlatLayout* flat = nullptr;  ///< with `charts`
  double omega = 0.0;                ///< period of the phases, a length; 0: there are none
  int density = 2;                   ///< lines a period
};

/// Writes a PNG of the panels of PGP Figure 1 that there are data for: scan, directions of
/// curvature, field, iso-lines with singularities, remesh and a close-up of it; for a layout the
/// figure's own: scan, field, iso-lines, charts, their parameterization, base complex. The size in
/// `options` is that of one panel at most. Works through the scan tile by tile. Throws InputError
/// or ResourceError when it can't be written.
void write_preview(const PreviewInput& input, const std::string& path,
                   const RenderOptions& options = {});

}  // namespace rattan
