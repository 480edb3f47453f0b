// SPDX-License-Identifier: MIT
#pragma once

// Polygon meshes as OBJ, PLY and OFF. Positions are written in full (origin added, rounded once to
// the nearest double) and read back to the last bit: text holds the shortest decimals that do. So
// are colours, but for their alpha in OBJ, which has none.

#include <string>
#include <string_view>

#include "engine/remesh/polygon_mesh.h"
#include "io/file/atomic_file.h"
#include "io/remesh/remesh_metadata.h"

namespace rattan {

void write_obj(const PolygonMesh& mesh, const RemeshMetadata& metadata, AtomicFile& out);
/// Binary little endian, double coordinates.
void write_ply(const PolygonMesh& mesh, const RemeshMetadata& metadata, AtomicFile& out);
void write_off(const PolygonMesh& mesh, const RemeshMetadata& metadata, AtomicFile& out);

/// Positions, polygons and colours of vertices (where some have one the others are white);
/// everything else a file holds (normals, texture coordinates, other elements) is skipped. `path`
/// is for messages. Throw InputError with the line or byte.
PolygonMesh parse_obj(std::string_view bytes, const std::string& path);
/// ASCII and binary of either byte order.
PolygonMesh parse_ply(std::string_view bytes, const std::string& path);
/// Also COFF, NOFF and CNOFF.
PolygonMesh parse_off(std::string_view bytes, const std::string& path);

}  // namespace rattan
