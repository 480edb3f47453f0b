// SPDX-License-Identifier: MIT
#pragma once

// A layout as a triangulation with a texture coordinate at every corner. The texture coordinates
// are those of FlatChart, of each part on its own: what lies beside a part is said by the
// transition functions (transition_writer.h).

#include <cstdint>
#include <functional>
#include <string>

#include "engine/layout/layout_source.h"
#include "io/remesh/remesh_metadata.h"

namespace rattan {

struct LayoutWriteOptions {
  /// Full position = position * unit + metadata.origin; ScanMesh::unit.
  double unit = 1.0;
  /// Of an `.obj`: file (`mtllib`) and name (`usemtl`) of its material; may be empty.
  std::string material_file;
  std::string material;
  /// Of a `.ply`: the image that texture coordinates refer to; may be empty.
  std::string image_file;
  /// Of a `.drc`: as for remeshes (WriteOptions); lengths of the file.
  int position_bits = 0;
  double position_accuracy = 0.0;
  int draco_speed = 3;
  /// Of a `.drc`: its texture coordinates lie on a grid of 2^-texture_bits of their unit, or a
  /// finer one; at least 0. In an atlas, AtlasPlan::bits(12), so that charts stay as exact as
  /// alone.
  int texture_bits = 12;
  /// For tests: called with the temporary's path before it is read back.
  std::function<void(const std::string&)> before_verify;
};

struct LayoutWriteResult {
  std::uint64_t bytes = 0;
  /// To be added to the file's positions for the scan's coordinates; zero but for some `.drc`.
  Vec3d origin{0.0, 0.0, 0.0};
  int position_bits = 0;        ///< of a `.drc`
  double position_bound = 0.0;  ///< no coordinate moved by more; 0 for the other formats
  /// Texture coordinates are whole multiples of this, exactly; 0 if they are not quantised.
  double texture_step = 0.0;
  /// Triangles that are not counter-clockwise in the texture coordinates of the file: 0 unless the
  /// layout itself has such, or some so thin that even unquantised float32 folds them.
  std::uint64_t folded = 0;
};

/// Throws UsageError for another extension than `.obj`, `.ply`, `.drc` (any case) and for draco
/// options out of range. To be asked before work begins.
void check_layout_output(const std::string& path, const LayoutWriteOptions& options = {});

/// What write_layout takes beside the source at its peak. Text and PLY are streamed: a few MiB. A
/// `.drc` is encoded in memory.
std::uint64_t layout_write_bytes(const std::string& path, std::uint64_t triangles);

/// Writes a layout in the format of path's extension:
/// - `.obj`: `v` of all vertices with full doubles (and colours); then for each chart a group
///   `chart_C`, or `chart_C_part_K` for each part of a split one, with its `vt` and `f v/vt`. All
///   numbers read back to the last bit.
/// - `.ply`: binary; vertices as above; faces with `texcoord` (three pairs; float, or double where
///   float would fold a triangle), `chart` and `part` (counted over all charts).
/// - `.drc`: texture coordinates on a grid of 2^-k of their unit, the coarsest from 2^-texture_bits
/// on where
///   no triangle folds, so that quarter turns and translations stay exact; the charts as a generic
///   attribute named "chart"; the length of a chart side as `chart_units` in the metadata.
///
/// The file is written under a temporary name, synced, read back and compared with the source, and
/// only then takes its name. After an exception nothing is left and an older file is untouched.
/// Same layout, metadata and options: same bytes. The source's vertices must be numbered without
/// gaps, and each be used by a triangle.
///
/// Throws UsageError (see above; a `.ply` or `.drc` of more vertices than the format can number),
/// InputError (the directory), ResourceError (disk full), InternalError (a source that contradicts
/// itself, a file that came back different, a mesh that Draco cannot hold whole), and what the
/// source throws.
LayoutWriteResult write_layout(LayoutSource& source, const RemeshMetadata& metadata,
                               const std::string& path, const LayoutWriteOptions& options = {});

}  // namespace rattan
