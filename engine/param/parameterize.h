// SPDX-License-Identifier: MIT
#pragma once

// From the tiled scan to the solved phase: the stages in their order. Each is a few passes over the
// tiles plus one solve; all share one vertex graph, one set of weights and one hierarchy.

#include <memory>
#include <optional>
#include <vector>

#include "engine/core/task_graph.h"
#include "engine/field/curl_correction.h"
#include "engine/field/curvature.h"
#include "engine/field/low_pass.h"
#include "engine/field/smoothing.h"
#include "engine/mesh/features.h"
#include "engine/mesh/tile_mesh.h"
#include "engine/solve/solver.h"

namespace rattan {

struct FieldOptions {
  /// h, the side of a quad, a length: what relief and fields are smoothed with respect to.
  double quad_side = 1.0;
  /// Reach of the low-pass of positions, in quad sides (capped; see low_pass.h). 0: positions as
  /// are.
  double low_pass = 0.7;
  /// Reach of the curvature's neighbourhood, in quad sides.
  double curvature_reach = 1.0;
  EdgeEnergy energy = EdgeEnergy::kTriangle;
  Symmetry symmetry = Symmetry::kFour;
  /// rho of PGP Eq. 21 in [0, 1); its fitting length is sqrt(rho / (1 - rho)) average edges.
  /// Without it, the fitting length is `fitting_length` quad sides.
  std::optional<double> smoothing;
  double fitting_length = 3.0;
  bool align_boundary = true;
  /// Sharp edges and long boundary loops; `side` is filled in.
  bool find_features = true;
  FeatureOptions features;
  /// Along features one coordinate is an integer line.
  bool pin_features = true;
  /// Without that: along boundary loops alone.
  bool pin_boundary = false;
  /// Power of the curl correction: 0 none, 1 full (PGP 4.1).
  double curl_power = 0.2;
  /// Geometric mean of its scales; without it their mean square is 1 (see CurlOptions).
  std::optional<double> curl_mean;
  HierarchyOptions hierarchy;
  /// The smoothing system; `reference` selects the paper's own procedure for it.
  /// Curvature leaves it no choice to start from, so one start will do.
  SolveOptions smoothing_solve{.penalty = 0.1F,
                               .coarse_stiffness = 0.5F,
                               .passes = 1,
                               .sweeps = 4,
                               .starts = 1,
                               .newton_steps = 0,
                               .tolerance = 1e-2F,
                               .unit_norm = true};
  SolveOptions curl_solve{
      .penalty = 0.0F, .coarse_stiffness = 0.5F, .tolerance = 1e-2F, .cycles = 1};
  bool reference = false;
};

struct ParamOptions {
  /// Period of the phases, a length: quad side times lines per period.
  double omega = 2.0;
  /// Lines a period: where pinned coordinates may lie.
  int density = 2;
  SolveOptions solve{.penalty = 0.2F,
                     .coarse_stiffness = 1.0F,
                     .passes = 1,
                     .sweeps = 5,
                     .starts_of_one_tile = 12,
                     .newton_steps = 0,
                     .tolerance = 1e-2F,
                     .unit_norm = true};
  /// The paper's locked CG and penalised Newton instead of nested iteration.
  bool reference = false;
  /// Leave fields::kPhaseNorms, for people to look at; nothing else changes.
  bool keep_norms = false;
};

/// What the stages pass on in memory; the rest is in the store.
struct SurfaceField {
  FieldOptions options;
  LowPassOptions low_pass;   ///< what prepare_geometry made of the options
  GeometryOptions geometry;  ///< likewise
  std::shared_ptr<const Hierarchy> hierarchy;
  std::shared_ptr<const FeatureSet> features;  ///< never null once prepared
  double area = 0.0;                           ///< of the low-passed surface
  std::vector<SolveReport> reports;
};

/// Vertex graph, low-passed positions, weights, normals, curvature, hierarchy. `previous`: what an
/// earlier call for the same scan and store returned; what these options don't change is kept, the
/// result is the same.
SurfaceField prepare_geometry(Store& store, const ScanMesh& mesh, const FieldOptions& options,
                              TaskGraph& tasks, const SurfaceField* previous = nullptr);

/// Smoothed directions: writes fields::kFrame with scale 1; adds its report to `field`.
void smooth_field(Store& store, const ScanMesh& mesh, SurfaceField& field, TaskGraph& tasks);

/// Scales of kFrame; nothing happens at power 0. Adds its report to `field`.
void correct_curl(Store& store, const ScanMesh& mesh, SurfaceField& field, TaskGraph& tasks);

/// Curvature, 1/length, below which the scan counts as flat.
double flat_curvature(const ScanMesh& mesh);

/// What features an interrupted or finished run found; empty if it hadn't come so far.
FeatureSet saved_features(Store& store);

/// Solves for fields::kPhase. May be called again for another omega: nothing before is redone.
SolveReport parameterize(Store& store, const ScanMesh& mesh, const SurfaceField& field,
                         const ParamOptions& options, TaskGraph& tasks);

/// prepare_geometry, smooth_field and correct_curl.
SurfaceField compute_field(Store& store, const ScanMesh& mesh, const FieldOptions& options,
                           TaskGraph& tasks, const SurfaceField* previous = nullptr);

}  // namespace rattan
