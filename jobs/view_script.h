// SPDX-License-Identifier: MIT
#pragma once

// A mesh as a script, for a 3D view in a page that is opened from the file system: browsers let
// such a page load scripts, but fetch nothing.

#include <cstddef>
#include <string>

#include "engine/remesh/polygon_mesh.h"

namespace rattan {

struct ViewScriptOptions {
  std::size_t most_faces = 50'000;  ///< more are reduced by merging what lies in one cell of a grid
};

/// Bytes that view_script() holds.
std::size_t view_script_bytes(const PolygonMesh& mesh, const ViewScriptOptions& options = {});

/// `rattan_view({...});` with
/// - `name`; `faces`, the mesh's own; `vertices`, of what follows;
/// - `groups`: [corners a face, faces] pairs, in the order of the faces;
/// - `scale`: length of a step of the coordinates; they are integers about the middle of the box;
/// - `view`: three rows: right, up and toward the eye, unit vectors; `up`: what is up;
/// - `data`: base64 of bytes in groups of seven bits, lowest first, the eighth says that more
///   follow. Each corner is 0 for a new vertex, else how many vertices ago its vertex came. A new
///   vertex is three differences (2 d, or -2 d - 1 below zero) from where it is expected: the
///   fourth corner of a quad completes a parallelogram, others are where the corner before was.
/// - `normals`, of a reduced mesh only: base64 of two bytes a vertex, the normal there of what was
///   reduced, (byte - 127.5) / 127 of its place on the octahedron.
/// About 11 characters a face, 3 more for normals.
std::string view_script(const PolygonMesh& mesh, const std::string& name,
                        const ViewScriptOptions& options = {});

}  // namespace rattan
