// SPDX-License-Identifier: MIT
#pragma once

// Folded and flat quads of a mesh that must have quads only, where moving vertices doesn't help.

#include <cstdint>

#include "engine/remesh/polygon_mesh.h"

namespace rattan {

struct MendReport {
  std::uint64_t collapsed = 0;  ///< taken out by merging two opposite corners
  std::uint64_t inset = 0;      ///< given a ring of quads, so that each corner is shared by two
};

/// Changes each quad whose scaled Jacobian (see quality.h) is at most `least`: it goes if no face
/// around comes out bad for that, else it becomes five. The new faces are to be optimised
/// afterwards; they may be bad as they are. Keeps every guarantee of quadrangulate.h.
MendReport mend_bad_quads(PolygonMesh& mesh, double least = 0.0);

}  // namespace rattan
