// SPDX-License-Identifier: MIT
#pragma once

// Polygon meshes as Draco files. Draco knows triangles only; polygons travel as its own encoder and
// decoder move them with `-preserve_polygons`: a generic 8-bit attribute named "added_edges" in its
// metadata is 1 at a triangle's corner when the edge opposite that corner only splits a polygon.

#include <cstdint>
#include <string>
#include <string_view>

#include "engine/remesh/polygon_mesh.h"
#include "io/remesh/remesh_metadata.h"

namespace rattan {

inline constexpr int kLeastPositionBits = 11;
inline constexpr int kMostPositionBits = 24;

struct DracoOptions {
  int position_bits = 0;  ///< kLeastPositionBits to kMostPositionBits; 0: from `accuracy`
  double accuracy = 0.0;  ///< largest step between positions, file units; 0: default_accuracy()
  int speed = 3;          ///< 0 (smallest file) to 5; faster settings tear vertices apart
};

struct DracoEncoding {
  std::string bytes;
  int position_bits = 0;
  double step = 0.0;  ///< distance of neighbouring quantised positions, per axis
  /// No coordinate is further than this from what was meant; half a step plus float32 rounding.
  double bound = 0.0;
  Vec3d origin;  ///< add to decoded positions for full coordinates; zero where they are full
  bool holds_full_coordinates = true;
  PolygonMesh expected;  ///< what a decoder must return, to the last bit, in some other order
};

/// The step positions are quantised with unless told otherwise: 1e-5 of the bounding box diagonal,
/// well below the distance a remesh keeps from its scan, or 1/200 of the mean edge if that is less,
/// which keeps normals of small faces within about a tenth of a degree.
double default_accuracy(const PolygonMesh& mesh);

/// Pre: every vertex is used, no face repeats a vertex, positions finite (see write_remesh). Throws
/// UsageError for options out of range, InternalError where Draco fails. Peak memory about 400
/// bytes a face.
DracoEncoding encode_draco(const PolygonMesh& mesh, const RemeshMetadata& metadata,
                           const DracoOptions& options);

/// Polygons as the stock decoder's OBJ output has them. Files without added edges give triangles;
/// degenerate triangles are left out. `path` is for messages. `metadata`, if not null, receives
/// what the file holds. Throws InputError for anything that is not a whole Draco mesh.
PolygonMesh decode_draco(std::string_view bytes, const std::string& path, RemeshMetadata* metadata);

}  // namespace rattan
