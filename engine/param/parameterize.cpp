// SPDX-License-Identifier: MIT
#include "engine/param/parameterize.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/core/packed_chunk.h"
#include "engine/param/periodic_energy.h"
#include "engine/param/solution_record.h"
#include "engine/solve/hierarchy.h"
#include "engine/solve/hierarchy_record.h"

namespace rattan {

// Member by member, since between them there is padding.
template <class A>
void members_of(A& a, CoarsePart& c) {
  a(c.done);
  a(c.setup_passes);
}

namespace {

// Below 1 / (1000 edges) curvature is noise: planes get no say in the field.
constexpr double kFlatEdges = 1000.0;
// From this power on, what one more cycle adds to log v matters.
constexpr double kWholeCurl = 0.5;

constexpr std::string_view kFeatures = "features/set";

// A system's border gauges, from the step that assembles it to the one that solves it.
constexpr Field<BlockOps<ComplexBlock>::Coefficient> kSmoothingGauges{"smoothing/border_gauge"};
constexpr Field<BlockOps<PairBlock>::Coefficient> kPhaseGauges{"param/border_gauge"};

template <class T>
HaloBoard<T> take_board(Store& store, Field<T> field) {
  const ChunkView<T> view = read(store, field, kBoardTile);
  HaloBoard<T> board(view.begin(), view.end());
  store.erase(field.name);
  return board;
}

template <class Block>
SolveReport solve(Store& store, const ScanMesh& mesh, const SystemFields<Block>& system,
                  const SurfaceField& field, const SolveOptions& options, bool reference,
                  const char* name, TaskGraph& tasks, SolveHooks<Block>& hooks) {
  SolveReport report =
      reference ? solve_reference(store, mesh.layout, fields::kMeshHalo, system, options, tasks)
                : solve_nested(store, mesh.layout, fields::kMeshHalo, system, *field.hierarchy,
                               options, tasks, &hooks);
  report.system = name;
  // Only the solution is needed from here on.
  for (const std::string_view used : {system.fit.name, system.rhs.name}) {
    if (!used.empty()) {
      store.erase(used);
    }
  }
  return report;
}

// All but the finest level, where that can be parted.
template <class Block>
CoarsePart solve_coarse_step(std::string_view name, Store& store, const SystemFields<Block>& system,
                             const SurfaceField& field, const SolveOptions& options, bool reference,
                             Field<Coefficient<Block>> gauges, TaskGraph& tasks) {
  if (reference || !can_solve_coarse(*field.hierarchy, options)) {
    return {};
  }
  Steps& steps = tasks.steps();
  steps.before_long_step();
  return steps.run(name, [&] {
    SolveHooks<Block> hooks;
    hooks.border_gauges = take_board(store, gauges);
    return solve_coarse(store, system, *field.hierarchy, options, tasks, hooks);
  });
}

// Whoever looks at an interrupted run's fields takes them for what the record says.
void forget_records(Store& store) {
  store.erase(fields::kFieldRecord);
  store.erase(fields::kPhaseRecord);
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
  Steps& steps = tasks.steps();
  const bool make_graph = previous == nullptr;
  FeatureOptions features = options.features;
  features.side = std::max(options.quad_side, mesh.mean_edge_length);
  field.low_pass.radius = capped_low_pass_radius(mesh, options.low_pass * options.quad_side);
  field.geometry.energy = options.energy;
  field.geometry.curvature_rounds =
      curvature_rounds(mesh, options.curvature_reach * options.quad_side);
  const bool same_surface = steps.run("features", [&] {
    if (options.find_features) {
      field.features = std::make_shared<const FeatureSet>(
          find_features(store, mesh, features, tasks, make_graph));
    } else {
      field.features = std::make_shared<const FeatureSet>();
      if (make_graph) {
        build_vertex_graph(store, mesh, tasks);
      }
    }
    const bool same =
        previous != nullptr && field.features->empty() && previous->features->empty() &&
        field.low_pass.radius == previous->low_pass.radius && field.geometry == previous->geometry;
    write_packed(store, kFeatures, *field.features);
    return same;
  });
  if (!field.features) {
    auto saved = std::make_shared<FeatureSet>();
    read_packed(store, kFeatures, *saved);
    field.features = std::move(saved);
  }
  field.low_pass.features = field.features.get();
  if (same_surface) {
    field.area = previous->area;
    field.hierarchy = previous->hierarchy;
    return field;
  }
  steps.before_long_step();
  steps.run("low-pass", [&] {
    forget_records(store);
    low_pass_positions(store, mesh, field.low_pass, tasks);
  });
  steps.before_long_step();
  field.area = steps.run("surface", [&] {
    FirstMatching matching(store, mesh.layout, fields::kMeshHalo);
    const double area = prepare_surface(store, mesh, field.geometry, tasks, &matching);
    matching.save();
    return area;
  });
  steps.run("hierarchy", [&] {
    FirstMatching matching(store, mesh.layout, fields::kMeshHalo);
    matching.load();
    field.hierarchy = build_hierarchy(store, mesh.layout, fields::kMeshHalo,
                                      {fields::kRowBegin, fields::kNeighbor, fields::kEdgeWeight},
                                      options.hierarchy, tasks, &matching);
    save_hierarchy(store, *field.hierarchy);
  });
  if (!field.hierarchy) {
    field.hierarchy = load_hierarchy(store);
  }
  return field;
}

double flat_curvature(const ScanMesh& mesh) {
  return 1.0 / std::max(kFlatEdges * mesh.mean_edge_length, 1e-30);
}

FeatureSet saved_features(Store& store) {
  FeatureSet features;
  if (store.has_chunk(kFeatures, TileId(0))) {
    read_packed(store, kFeatures, features);
  }
  return features;
}

void smooth_field(Store& store, const ScanMesh& mesh, SurfaceField& field, TaskGraph& tasks) {
  const FieldOptions& options = field.options;
  SmoothingOptions smoothing;
  smoothing.symmetry = options.symmetry;
  smoothing.fitting_length = std::max(fitting_length(mesh, options), 1e-30);
  smoothing.floor_curvature = flat_curvature(mesh);
  smoothing.align_boundary = options.align_boundary;
  smoothing.features = field.features.get();
  smoothing.pin = options.pin_features;
  smoothing.pin_boundary = options.pin_boundary;
  Steps& steps = tasks.steps();
  steps.run("smoothing system", [&] {
    BorderGauges<ComplexBlock> gauges(*field.hierarchy);
    assemble_smoothing(store, mesh, smoothing, tasks, &gauges);
    write(store, kSmoothingGauges, kBoardTile, gauges.take());
  });
  const CoarsePart coarse =
      solve_coarse_step("coarse smoothing", store, fields::kSmoothingSystem, field,
                        options.smoothing_solve, options.reference, kSmoothingGauges, tasks);
  steps.before_long_step();
  field.reports.push_back(steps.run("smoothing", [&] {
    forget_records(store);
    FrameWriter frames(store, mesh, smoothing);
    SolveHooks<ComplexBlock> hooks;
    hooks.coarse = coarse;
    if (!coarse.done) {
      hooks.border_gauges = take_board(store, kSmoothingGauges);
    }
    hooks.consume = [&](TileId id) { return frames.tile(id); };
    SolveReport report =
        solve(store, mesh, fields::kSmoothingSystem, field, options.smoothing_solve,
              options.reference, "smoothing", tasks, hooks);
    store.erase(fields::kSmoothingSystem.coefficient.name);
    if (!hooks.consumed) {
      consume_solution(store, mesh.layout, fields::kSmoothingSystem.solution, hooks, tasks);
      store.erase(fields::kSmoothingSystem.solution.name);
    }
    frames.finish();
    write_packed(store, fields::kFieldRecord,
                 FieldRecord{.quad_side = options.quad_side,
                             .fitting_length = smoothing.fitting_length,
                             .floor_curvature = smoothing.floor_curvature,
                             .curl_power = 0.0,
                             .symmetry = static_cast<int>(options.symmetry),
                             .reports = {report}});
    return report;
  }));
}

void correct_curl(Store& store, const ScanMesh& mesh, SurfaceField& field, TaskGraph& tasks) {
  const FieldOptions& options = field.options;
  if (options.curl_power == 0.0) {
    return;
  }
  CurlOptions curl;
  curl.power = options.curl_power;
  curl.mean = options.curl_mean;
  SolveOptions solve_options = options.curl_solve;
  if (curl.power > kWholeCurl) {
    solve_options.cycles = std::max(solve_options.cycles, 2);
  }
  Steps& steps = tasks.steps();
  steps.run("curl system", [&] { assemble_curl(store, mesh, tasks); });
  field.reports.push_back(steps.run("curl", [&] {
    ScaleWriter scales(store, mesh, curl);
    SolveHooks<RealBlock> hooks;
    hooks.moments = [&](double mean, double variance) { scales.even_out(mean, variance); };
    hooks.consume = [&](TileId id) { return scales.tile(id); };
    SolveReport report = solve(store, mesh, fields::kCurlSystem, field, solve_options,
                               options.reference, "curl", tasks, hooks);
    if (hooks.consumed) {
      scales.finish();
    } else {
      apply_scale(store, mesh, curl, tasks);
      store.erase(fields::kCurlSystem.solution.name);
    }
    FieldRecord record =
        find_record<FieldRecord>(store, fields::kFieldRecord).value_or(FieldRecord{});
    record.curl_power = curl.power;
    record.reports.push_back(report);
    write_packed(store, fields::kFieldRecord, record);
    return report;
  }));
}

SolveReport parameterize(Store& store, const ScanMesh& mesh, const SurfaceField& field,
                         const ParamOptions& options, TaskGraph& tasks) {
  const bool pinned = field.features != nullptr && !field.features->empty();
  const bool pulled = pinned && options.density % 2 == 1;
  const SystemFields<PairBlock>& system =
      pulled ? fields::kPulledPhaseSystem
             : (pinned ? fields::kPinnedPhaseSystem : fields::kPhaseSystem);
  Steps& steps = tasks.steps();
  steps.before_long_step();
  steps.run("phase system", [&] {
    BorderGauges<PairBlock> gauges(*field.hierarchy);
    if (pulled) {
      assemble_pulled_phase(store, mesh, options.omega, tasks, &gauges);
    } else if (pinned) {
      assemble_pinned_phase(store, mesh, options.omega, tasks, &gauges);
    } else {
      assemble_phase(store, mesh, options.omega, tasks, &gauges);
    }
    write(store, kPhaseGauges, kBoardTile, gauges.take());
  });
  const CoarsePart coarse = solve_coarse_step("coarse phase", store, system, field, options.solve,
                                              options.reference, kPhaseGauges, tasks);
  steps.before_long_step();
  return steps.run("phase", [&] {
    store.erase(fields::kPhaseRecord);
    store.erase(fields::kPhaseNorms.name);
    SolveHooks<PairBlock> hooks;
    hooks.coarse = coarse;
    if (!coarse.done) {
      hooks.border_gauges = take_board(store, kPhaseGauges);
    }
    SolveOptions solving = options.solve;
    if (options.keep_norms) {
      solving.norms = fields::kPhaseNorms;
    }
    SolveReport report = solve(store, mesh, system, field, solving, options.reference,
                               "parameterization", tasks, hooks);
    store.erase(system.coefficient.name);
    if (pinned) {
      store.erase(system.part_diagonal.name);
    }
    if (pinned && !pulled) {
      store.erase(system.row_begin.name);
      store.erase(system.neighbor.name);
    }
    write_packed(store, fields::kPhaseRecord, PhaseRecord{options.omega, options.density, report});
    return report;
  });
}

SurfaceField compute_field(Store& store, const ScanMesh& mesh, const FieldOptions& options,
                           TaskGraph& tasks, const SurfaceField* previous) {
  SurfaceField field = prepare_geometry(store, mesh, options, tasks, previous);
  smooth_field(store, mesh, field, tasks);
  correct_curl(store, mesh, field, tasks);
  return field;
}

}  // namespace rattan
