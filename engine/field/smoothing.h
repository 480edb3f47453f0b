// SPDX-License-Identifier: MIT
#pragma once

// Field smoothing (PGP 4.2): one system of unit complex numbers z = e^{i N alpha}, alpha the angle
// of the direction K in the vertex's own tangent frame,
//
//   sum_edges w_ij |z_i - e^{i N beta_ij} z_j|^2 + sum_i d_i |z_i - z0_i|^2,
//
// d_i = area_i * fidelity_i / fitting_length^2: how far a direction reaches does not depend on the
// sampling. rho of the paper corresponds to a fitting length of sqrt(rho / (1 - rho)) edges.

#include "engine/core/task_graph.h"
#include "engine/field/field_data.h"
#include "engine/mesh/features.h"
#include "engine/solve/border_gauges.h"
#include "engine/solve/solver.h"

namespace rattan {

/// Directions are equal modulo 2 pi / N.
enum class Symmetry : int { kOne = 1, kTwo = 2, kFour = 4 };

struct SmoothingOptions {
  Symmetry symmetry = Symmetry::kFour;
  /// Length over which directions blend where curvature is fully trusted.
  double fitting_length = 1.0;
  /// Below this curvature (1/length) the surface counts as flat.
  double floor_curvature = 0.0;
  /// Boundary vertices follow the boundary tangent (N = 4 only).
  bool align_boundary = true;
  /// Vertices on its curves follow their tangents (N = 4 only); may be null.
  const FeatureSet* features = nullptr;
  /// Whether coordinates are to be lines along features (see VertexFrame::pins).
  bool pin = false;
  /// Whether they are to be along boundary loops, if nowhere else.
  bool pin_boundary = false;
};

namespace fields {
inline constexpr SystemFields<ComplexBlock> kSmoothingSystem{
    kRowBegin,         kNeighbor,         {"smoothing/coefficient"}, kDiagonal,
    {"smoothing/fit"}, {"smoothing/rhs"}, {"smoothing/solution"}};
}  // namespace fields

/// One pass: writes coefficient, fit and rhs of kSmoothingSystem from kNormal, kCurvature,
/// kSmoothPosition and the graph. Directions that come with the scan (kWantedDirection) take the
/// place of curvature everywhere, and of the boundary where they say something. Returns the sum of
/// d_i over the scan: 0 if nothing says where to point, as on a plane without boundary alignment.
/// `gauges`: what the solve's coarsening needs, found on the way.
double assemble_smoothing(Store& store, const ScanMesh& mesh, const SmoothingOptions& options,
                          TaskGraph& tasks, BorderGauges<ComplexBlock>* gauges = nullptr);

/// Turns the solution into kFrame (scale 1), tile by tile in the pass that consumes it. Where the
/// solution vanishes, any direction serves. On feature curves that the solution follows, K or
/// K_perp is set to the tangent itself, and pinned.
class FrameWriter {
 public:
  /// All must outlive the writer.
  FrameWriter(Store& store, const ScanMesh& mesh, const SmoothingOptions& options);
  std::unique_ptr<SolutionTask<ComplexBlock>> tile(TileId id);
  /// After the pass: the board.
  void finish();

 private:
  class Tile;
  Store& store_;
  const ScanMesh& mesh_;
  const SmoothingOptions& options_;
  bool features_;  ///< whether curves are followed
  BoardWriter<VertexFrame> board_;
};

}  // namespace rattan
