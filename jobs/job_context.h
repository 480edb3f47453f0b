// SPDX-License-Identifier: MIT
#pragma once

// What the parts of one remeshing job share.

#include <memory>
#include <optional>

#include "engine/param/parameterize.h"
#include "engine/remesh/boundary_curve.h"
#include "engine/remesh/refine_loops.h"
#include "io/store/hdf5_store.h"
#include "jobs/job_steps.h"
#include "jobs/remesh_options.h"
#include "jobs/stage_clock.h"
#include "jobs/target_size.h"
#include "jobs/working_mesh.h"

namespace rattan {

/// Sharp edges and smooth boundaries come back within a thousandth of the scan's diagonal.
inline constexpr double kCurveTolerance = 0.85e-3;

struct JobContext {
  JobContext(const RemeshOptions& the_options, MemoryBudget& the_budget, Hdf5Store& the_store,
             TaskGraph& the_tasks, StageClock& the_clock, JobSteps& the_steps)
      : options(the_options),
        budget(the_budget),
        store(the_store),
        tasks(the_tasks),
        clock(the_clock),
        steps(the_steps),
        remesh(the_store) {}

  const RemeshOptions& options;
  MemoryBudget& budget;
  Hdf5Store& store;
  TaskGraph& tasks;
  StageClock& clock;
  JobSteps& steps;

  ScanMesh mesh;
  SurfaceField field;
  TargetSize target;  ///< of the size being made
  WorkingMesh remesh;

  /// Does `work` as a step that changes the remesh.
  template <class Work>
  auto remesh_step(std::string_view name, const Work& work) {
    return steps.run(name, [&] {
      auto result = work();
      remesh.save();
      return result;
    });
  }

  bool keeps_loops() const { return !options.pure_quads && mesh.topology.boundary_loops > 0; }
  double curve_tolerance() const { return kCurveTolerance * mesh.diagonal(); }
  /// Of the scan; a pass over the tiles the first time. Inside steps only.
  const BoundaryCurve& boundary_curve() {
    if (!curve_) {
      curve_.emplace(store, mesh, tasks);
      loops_.emplace(*curve_, field.features->has_clear_edges());
    }
    return *curve_;
  }
  const BoundaryLoops& boundary_loops() {
    boundary_curve();
    return *loops_;
  }

 private:
  std::optional<BoundaryCurve> curve_;
  std::optional<BoundaryLoops> loops_;
};

}  // namespace rattan
