// SPDX-License-Identifier: MIT
#pragma once

// Extraction of the cell complex: iso-lines of the periodic parameterization, arranged on the
// surface.

#include <cstdint>
#include <limits>

#include "engine/core/errors.h"
#include "engine/core/memory_budget.h"
#include "engine/core/store.h"
#include "engine/core/task_graph.h"
#include "engine/layout/cell_complex.h"
#include "engine/mesh/tile_mesh.h"
#include "engine/param/triangle_coordinates.h"

namespace rattan {

class FeatureSet;

struct ArrangementOptions {
  double omega = 1.0;  ///< the period, a length; positive
  int density = 2;     ///< iso-lines a period, at least 1; the cells' side is omega / density
  /// Boundary vertices that turn further, both from edge to edge and at the scale of the cells,
  /// become vertices.
  double corner_degrees = 50.0;
  /// Its sharp edges become edges of cells; may be null, else outlives the call.
  const FeatureSet* features = nullptr;
  /// In one tile lines may cross each other so often; more is TooManyCrossings.
  std::uint64_t most_crossings = std::numeric_limits<std::uint64_t>::max();
  /// Faces with more strands around them are divided further, as far as a few rounds go; 0: any
  /// number will do.
  std::uint32_t most_sides = 0;
  /// Crossings on a scan edge keep so far from its ends and each other, in parts of the edge: where
  /// they become vertices of triangles.
  double gap = 0.0;
  /// Ledger for the graphs and what is made of them; may be null.
  MemoryBudget* budget = nullptr;
};

/// Lines so close together make a mesh far larger than wanted, or than memory: on triangles much
/// longer than the period crossings grow with the square of the length. Wider lines will do.
class TooManyCrossings : public ResourceError {
 public:
  TooManyCrossings()
      : ResourceError("The quads are too small for the scan's longest triangles. Ask for fewer.") {}
};

struct ArrangementReport {
  SingularityCounts singularities;
  std::uint64_t dangling_ends = 0;    ///< line ends in singular triangles; their paths were dropped
  std::uint64_t dropped_circles = 0;  ///< contractible closed lines without a crossing
  std::uint64_t bare_components = 0;  ///< closed components without a line, split into cells
  std::uint64_t cut_faces = 0;        ///< faces that were no disks
  std::uint64_t cut_rounds = 0;
  std::uint64_t spaced_vertices = 0;  ///< added along long edges and closed ones
};

/// Reads the mesh, fields::kFrame and fields::kPhase (owned values and boards) tile by tile. The
/// result is a decomposition of the scan into disks with the scan's Euler characteristic,
/// components and boundary loops, and does not depend on the tiling or on threads. In memory: the
/// output several times, and about 70 bytes per edge on the rims of tiles. Throws UsageError for
/// options out of range, TooManyCrossings, InternalError if the decomposition failed.
CellComplex extract_cells(Store& store, const ScanMesh& mesh, const ArrangementOptions& options,
                          TaskGraph& graph, ArrangementReport& report);

}  // namespace rattan
