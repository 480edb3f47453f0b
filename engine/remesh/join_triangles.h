// SPDX-License-Identifier: MIT
#pragma once

// The last triangles of a mesh that shall have quads only: two of them, or one and the boundary,
// are joined by a chord, a new line through the quads between.

#include <cstdint>

#include "engine/remesh/cell_map.h"

namespace rattan {

struct JoinReport {
  std::uint64_t merged = 0;     ///< pairs of neighbours that became one quad
  std::uint64_t chords = 0;     ///< pairs joined by a new line
  std::uint64_t at_border = 0;  ///< triangles joined to the boundary by a new line
  std::uint64_t left = 0;       ///< triangles that nothing could be done for
};

/// Pre: a simple map whose cells are triangles and quads. Post: the same, and triangles are left
/// only in components in which no two have a path of quads between them and none has one to the
/// boundary (a tetrahedron, a lone triangle). A chord divides each edge that it crosses, so a
/// triangle at its end gains a corner; quads are divided in two where it goes straight and in three
/// around a new vertex where it turns. All new faces have new vertices: nothing can be doubled.
/// Paths are found in parallel and carried out in the order of their length, ties by face.
JoinReport join_triangles(CellMap& map);

}  // namespace rattan
