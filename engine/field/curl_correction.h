// SPDX-License-Identifier: MIT
#pragma once

// Curl correction (PGP 4.1): a scale v at every vertex that makes v K and v K_perp curl-free as far
// as one scale can, by least squares for log v:
//
//   sum_edges w_ij (log v_j - log v_i - t_ij)^2,   t_ij = (grad gamma turned by +90 degrees) .
//   e_ij,
//
// gamma the angle of the field, re-oriented consistently inside each triangle. The targets belong
// to edges, so that they stay right where weights are clamped.

#include <memory>
#include <optional>
#include <span>

#include "engine/core/task_graph.h"
#include "engine/field/field_data.h"
#include "engine/solve/solver.h"

namespace rattan {

struct CurlOptions {
  /// v is the solution to this power: 1 removes the curl, less keeps sizes more even.
  double power = 0.2;
  /// |log v| is cut off here before the power.
  double most_log = 3.0;
  /// Geometric mean of the scales over the area. Without it their mean square is made 1: then the
  /// number of quads is that without correction.
  std::optional<double> mean;
};

namespace fields {
inline constexpr SystemFields<RealBlock> kCurlSystem{
    kRowBegin,
    kNeighbor,
    {"graph/weight"},  // kEdgeWeight: a coefficient of RealBlock is the
                       // weight alone
    kDiagonal,
    {"curl/fit"},
    {"curl/rhs"},
    {"curl/solution"}};
}  // namespace fields

/// One pass: writes fit and rhs of kCurlSystem from kFrame and the graph. Triangles with a field
/// singularity say nothing. The fit is a very weak pull to zero, the same per area everywhere;
/// since the targets sum to zero on each component, it makes the area-weighted mean of log v vanish
/// there: v has the geometric mean 1 on every component.
void assemble_curl(Store& store, const ScanMesh& mesh, TaskGraph& tasks);

/// v = e^{power log v} from the solution of kCurlSystem, before it is made even; cut off.
double curl_scale(double log_v, const CurlOptions& options);

/// Rewrites kFrame with its scales, tile by tile in the pass that consumes the solution.
class ScaleWriter {
 public:
  /// All must outlive the writer.
  ScaleWriter(Store& store, const ScanMesh& mesh, const CurlOptions& options);
  /// Before the pass: the mean of curl_scale^2 over the area. Scales are divided by its root, so
  /// that the integral of v^2 is the area and the number of quads doesn't change.
  void even_out(double mean_square);
  /// Likewise, from the mean and variance of log v over the area: as if that were Gaussian, which
  /// is within a percent of what it is. Where the options give a mean, by that.
  void even_out(double mean, double variance);
  std::unique_ptr<SolutionTask<RealBlock>> tile(TileId id);
  /// After the pass: the board.
  void finish();

 private:
  class Tile;
  Store& store_;
  CurlOptions options_;
  double even_ = 1.0;
  BoardWriter<VertexFrame> board_;
};

/// Two passes over a stored solution: its mean and mean square, then the frames.
void apply_scale(Store& store, const ScanMesh& mesh, const CurlOptions& options, TaskGraph& tasks);

}  // namespace rattan
