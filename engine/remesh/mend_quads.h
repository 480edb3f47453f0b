// SPDX-License-Identifier: MIT
#pragma once

// Folded and flat quads of a mesh that must have quads only, where moving vertices doesn't help.

#include <cstddef>
#include <cstdint>
#include <functional>

#include "engine/core/task_graph.h"
#include "engine/remesh/polygon_mesh.h"
#include "engine/remesh/surface_projector.h"
#include "engine/remesh/untangle.h"

namespace rattan {

struct MendReport {
  std::uint64_t collapsed = 0;  ///< taken out by merging two opposite corners
  std::uint64_t inset = 0;      ///< given a ring of quads, so that each corner is shared by two
};

/// Changes each quad whose scaled Jacobian (see quality.h) is at most `least`: it goes if no face
/// around comes out bad for that, else it becomes five. The new faces are to be optimised
/// afterwards; they may be bad as they are. Keeps every guarantee of quadrangulate.h.
MendReport mend_bad_quads(PolygonMesh& mesh, double least = 0.0);

/// Untangles and mends in turns until no quad is bad, or a few times. Curves are held on ever
/// longer leashes before the next quads are changed, as each inset leaves four irregular vertices.
/// The best mesh on the way is kept among those whose number of faces is `acceptable`; that of
/// `mesh` is. Returns how many bad quads are left.
std::uint64_t mend_until_good(PolygonMesh& mesh, SurfaceProjector& projector,
                              const UntangleOptions& options, TaskGraph& graph,
                              const std::function<bool(std::size_t)>& acceptable);

}  // namespace rattan
