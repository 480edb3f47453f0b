// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "engine/remesh/polygon_mesh.h"
#include "io/remesh/remesh_metadata.h"

namespace rattan {

struct WriteOptions {
  /// Of a `.drc`: bits a coordinate, 11 to 24; 0 lets the accuracy decide.
  int position_bits = 0;
  /// Of a `.drc` without position_bits: the largest step between positions, a length of the file;
  /// 0: default_accuracy() of draco_polygons.h.
  double position_accuracy = 0.0;
  /// Of a `.drc`: Draco's encoder speed, 0 (smallest file) to 5.
  int draco_speed = 3;
  /// For tests: called with the temporary's path before it is read back.
  std::function<void(const std::string&)> before_verify;
};

struct WriteResult {
  std::uint64_t bytes = 0;
  std::uint64_t vertices = 0;  ///< in the file
  std::uint64_t faces = 0;
  /// To be added to the file's positions for the scan's coordinates. Zero but for a `.drc` whose
  /// full coordinates float32 would spoil.
  Vec3d origin{0.0, 0.0, 0.0};
  int position_bits = 0;        ///< of a `.drc`
  double position_bound = 0.0;  ///< no coordinate moved by more; 0 for the other formats
};

/// Writes `mesh` (positions relative to metadata.origin) in the format of path's extension. The
/// file is written under a temporary name, synced, read back through read_polygons and compared
/// face by face with what was meant, and only then takes its name, replacing what stood there.
/// After an exception nothing is left and an older file is untouched. Vertices that no face uses
/// are left out.
///
/// Same mesh, metadata and options: same bytes.
/// Throws UsageError (extension, option out of range), InputError (the directory), ResourceError
/// (disk full), InternalError (a face with under three or repeated corners, a position that is not
/// finite, a mesh Draco cannot hold whole: non-manifold or inconsistently oriented, a file that
/// came back different).
WriteResult write_remesh(const PolygonMesh& mesh, const RemeshMetadata& metadata,
                         const std::string& path, const WriteOptions& options = {});

}  // namespace rattan
