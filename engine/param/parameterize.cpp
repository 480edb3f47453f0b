// SPDX-License-Identifier: MIT
#include "engine/param/parameterize.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/param/periodic_energy.h"

namespace rattan {

namespace {

// Below 1 / (1000 edges) curvature is noise: planes get no say in the field.
constexpr double kFlatEdges = 1000.0;

template <class Block>
SolveReport solve(Store& store, const ScanMesh& mesh, const SystemFields<Block>& system,
                  const SurfaceField& field, const SolveOptions& options, bool reference,
                  const char* name, TaskGraph& tasks) {
  SolveReport report =
      reference ? solve_reference(store, mesh.layout, fields::kMeshHalo, system, options, tasks)
                : solve_nested(store, mesh.layout, fields::kMeshHalo, system, *field.hierarchy,
                               options, tasks);
  report.system = name;
  // Only the solution is needed from here on.
  for (const std::string_view used : {system.fit.name, system.rhs.name}) {
    if (!used.empty()) {
      store.erase(used);
    }
  }
  return report;
}

double fitting_length(const ScanMesh& mesh, const FieldOptions& options) {
  const double edge = mesh.mean_edge_length;
  if (options.smoothing) {
    const double rho = std::clamp(*options.smoothing, 1e-6, 1.0 - 1e-9);
    return edge * std::sqrt(rho / (1.0 - rho));
  }
  return options.fitting_length * std::max(options.quad_side, edge);
}

}  // namespace

SurfaceField prepare_geometry(Store& store, const ScanMesh& mesh, const FieldOptions& options,
                              TaskGraph& tasks, const SurfaceField* previous) {
  SurfaceField field;
  field.options = options;
  field.low_pass.radius = capped_low_pass_radius(mesh, options.low_pass * options.quad_side);
  field.geometry.energy = options.energy;
  field.geometry.curvature_rounds =
      curvature_rounds(mesh, options.curvature_reach * options.quad_side);
  if (previous == nullptr) {
    build_vertex_graph(store, mesh, tasks);
  } else if (field.low_pass == previous->low_pass && field.geometry == previous->geometry) {
    field.area = previous->area;
    field.hierarchy = previous->hierarchy;
    return field;
  }
  low_pass_positions(store, mesh, field.low_pass, tasks);
  field.area = prepare_surface(store, mesh, field.geometry, tasks);
  field.hierarchy = build_hierarchy(store, mesh.layout, fields::kMeshHalo,
                                    {fields::kRowBegin, fields::kNeighbor, fields::kEdgeWeight},
                                    options.hierarchy, tasks);
  return field;
}

void smooth_field(Store& store, const ScanMesh& mesh, SurfaceField& field, TaskGraph& tasks) {
  const FieldOptions& options = field.options;
  SmoothingOptions smoothing;
  smoothing.symmetry = options.symmetry;
  smoothing.fitting_length = std::max(fitting_length(mesh, options), 1e-30);
  smoothing.floor_curvature = 1.0 / std::max(kFlatEdges * mesh.mean_edge_length, 1e-30);
  smoothing.align_boundary = options.align_boundary;
  assemble_smoothing(store, mesh, smoothing, tasks);
  field.reports.push_back(solve(store, mesh, fields::kSmoothingSystem, field,
                                options.smoothing_solve, options.reference, "smoothing", tasks));
  store.erase(fields::kSmoothingSystem.coefficient.name);
  write_frames(store, mesh, options.symmetry, tasks);
}

void correct_curl(Store& store, const ScanMesh& mesh, SurfaceField& field, TaskGraph& tasks) {
  const FieldOptions& options = field.options;
  if (options.curl_power == 0.0) {
    return;
  }
  CurlOptions curl;
  curl.power = options.curl_power;
  assemble_curl(store, mesh, tasks);
  field.reports.push_back(solve(store, mesh, fields::kCurlSystem, field, options.curl_solve,
                                options.reference, "curl", tasks));
  apply_scale(store, mesh, curl, tasks);
}

SolveReport parameterize(Store& store, const ScanMesh& mesh, const SurfaceField& field,
                         const ParamOptions& options, TaskGraph& tasks) {
  assemble_phase(store, mesh, options.omega, tasks);
  SolveReport report = solve(store, mesh, fields::kPhaseSystem, field, options.solve,
                             options.reference, "parameterization", tasks);
  store.erase(fields::kPhaseSystem.coefficient.name);
  return report;
}

SurfaceField compute_field(Store& store, const ScanMesh& mesh, const FieldOptions& options,
                           TaskGraph& tasks, const SurfaceField* previous) {
  SurfaceField field = prepare_geometry(store, mesh, options, tasks, previous);
  smooth_field(store, mesh, field, tasks);
  correct_curl(store, mesh, field, tasks);
  return field;
}

}  // namespace rattan
