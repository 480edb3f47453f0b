// SPDX-License-Identifier: MIT
#pragma once

// How a remesh differs from its scan: every figure of `rattan compare`.

#include <cstdint>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "engine/core/progress.h"
#include "engine/mesh/tile_mesh.h"
#include "engine/remesh/distance.h"
#include "engine/remesh/quality.h"
#include "engine/remesh/topology.h"

namespace rattan {

struct CompareOptions {
  std::string remesh;  ///< .drc, .obj, .ply, .off with any polygons, or any scan
  std::string scan;    ///< any scan, or a .drc
  /// Points spread over each surface by area, beside all vertices.
  std::uint64_t samples = 300000;
  /// Bytes; 0 takes half of the memory that the machine has available.
  std::uint64_t memory = 0;
  /// 0 uses every processor that the process may run on.
  int threads = 0;
  std::string work_dir;  ///< for a scan beyond the memory; empty: in the system's temporary folder
};

struct CompareReport {
  CompareOptions options;
  // As the file has it: nothing is repaired.
  MeshTopology remesh;
  MeshQuality quality;
  // Repaired like the input of `rattan remesh`.
  ScanTopology scan;
  RepairCounts repaired;
  double scan_area = 0.0;
  DistanceReport distance;

  /// Components, boundary loops and Euler characteristic agree.
  bool same_topology() const;
};

/// The remesh is held in memory, about 250 bytes a face; the scan goes through tiles within the
/// budget. The same for any number of threads and any budget. Throws InputError for a file that
/// can't be read or that holds no surface, UsageError and ResourceError like remesh_scan.
CompareReport compare_surfaces(const CompareOptions& options, ProgressSink& progress);

/// Stable names: see the README. Distances in % of the scan's diagonal.
nlohmann::ordered_json to_json(const CompareReport& report);

}  // namespace rattan
