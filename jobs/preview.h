// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "engine/core/store.h"
#include "engine/core/task_graph.h"
#include "engine/mesh/tile_mesh.h"
#include "engine/remesh/polygon_mesh.h"

namespace rattan {

/// What the picture shows; the store holds the scan, the field and the phases.
struct PreviewInput {
  Store& store;
  const ScanMesh& scan;
  const PolygonMesh& remesh;
  double omega = 1.0;  ///< period of the phases, a length
  int density = 2;     ///< lines a period
};

/// Writes a PNG of four panels as in PGP Figure 1: scan, field, iso-lines with singularities,
/// remesh. Works through the scan tile by tile. Throws InputError or ResourceError when it can't be
/// written.
void write_preview(const PreviewInput& input, const std::string& path);

}  // namespace rattan
