// SPDX-License-Identifier: MIT
#include "jobs/quad_maker.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "engine/core/resident_memory.h"
#include "engine/remesh/quadrangulate.h"
#include "engine/remesh/refine_creases.h"
#include "jobs/memory_plan.h"
#include "jobs/size_search.h"
#include "jobs/work_record.h"

namespace rattan {

namespace {

// Boundary loops shorter than this, in quad sides, get their vertices before all else.
constexpr double kShortLoop = 12.0;
// On objects with clear edges, whose windows are meant.
constexpr double kShortClearLoop = 20.0;

}  // namespace

// The fields of a try replace those of the one before, so where an earlier one was the best, it is
// made again: report and preview then show the mesh that is written.
void QuadMaker::make_to_size() {
  SizeSearch search(job_.target.faces, first_side());
  double made = 0.0;
  while (!search.done()) {
    const double side = search.side();
    if (make_at(side, most_faces())) {
      made = side;
      search.tell(refined_faces_);
      continue;
    }
    made = 0.0;
    if (std::isfinite(extracted_.expected_faces)) {
      search.tell(extracted_.expected_faces);
    } else {
      search.tell_more_than(most_faces());
    }
  }
  if (search.best_side() != made) {
    make_at(search.best_side(), std::numeric_limits<double>::infinity());
  }
}

bool QuadMaker::make_from_last(int density) {
  density_ = density;
  return draw(most_faces()) && expected_to_meet();
}

bool QuadMaker::expected_to_meet() const {
  return meets_target(refined_faces_, job_.target);
}

// On spikes much thinner than a quad, lines cross each other thousands of times more often than the
// area says. A try this far off only has to say so: its faces needn't be made.
double QuadMaker::most_faces() const {
  return 2e4 + 8.0 * job_.target.faces;
}

// Lines are laid on the low-passed surface, which is smaller than the scan by as much as there is
// noise and relief; with its area the first solve meets the count within 2 % on most scans.
double QuadMaker::first_side() const {
  const double share = job_.mesh.area > 0.0 ? job_.field.area / job_.mesh.area : 1.0;
  return job_.target.quad_side * std::sqrt(std::clamp(share, 0.1, 1.5));
}

bool QuadMaker::make_at(double side, double most) {
  density_ = job_.options.density;
  omega_ = side * density_;
  job_.clock.run("parameterize", [&] {
    ParamOptions options;
    options.omega = omega_;
    options.density = density_;
    options.solve.newton_steps = job_.options.newton_steps;
    options.reference = job_.options.solver == SolverKind::kReference;
    options.keep_norms = job_.options.keep_work;
    job_.steps.depend_on(fmt::format("omega={:a} density={} newton-steps={} reference={}", omega_,
                                     density_, options.solve.newton_steps, options.reference));
    phase_report_ = parameterize(job_.store, job_.mesh, job_.field, options, job_.tasks);
  });
  return draw(most);
}

bool QuadMaker::draw(double most) {
  const PromptReturn prompt(job_.budget.tight());
  std::optional<CellComplex> cells;
  output_memory_.release();
  job_.steps.depend_on(fmt::format("omega={:a} density={} most={:a} pure-quads={} side={:a}",
                                   omega_, density_, most, job_.options.pure_quads,
                                   job_.target.quad_side));
  extracted_ = job_.clock.run("extract", [&] {
    job_.steps.before_long_step();
    return job_.steps.run("extract", [&] { return extract(most, cells); });
  });
  if (std::isfinite(extracted_.expected_faces)) {
    output_memory_ = job_.budget.reserve(output_bytes(extracted_.expected_faces), "the remesh");
  }
  if (extracted_.expected_faces > most) {
    return false;
  }
  refined_faces_ = job_.clock.run("quadrangulate", [&] {
    return job_.remesh_step("quadrangulate", [&] { return quadrangulate_cells(cells); });
  });
  return true;
}

// Leaves the cells in the store, unless more than `most` faces are to be expected of them.
QuadMaker::Extracted QuadMaker::extract(double most, std::optional<CellComplex>& cells) {
  // A mesh of quads has as many vertices as faces, and each is a crossing.
  constexpr double kCrossings = 4.0;
  ArrangementOptions options{.omega = omega_,
                             .density = density_,
                             .features = job_.field.features.get(),
                             .budget = &job_.budget};
  if (std::isfinite(most)) {
    options.most_crossings = static_cast<std::uint64_t>(kCrossings * most);
  }
  Extracted result;
  try {
    cells = extract_cells(job_.store, job_.mesh, options, job_.tasks, result.report);
  } catch (const TooManyCrossings&) {
    result.expected_faces = std::numeric_limits<double>::infinity();
    return result;
  }
  result.expected_faces = expected_faces(*cells);
  if (result.expected_faces <= most) {
    save_cells(job_.store, *cells);
  }
  return result;
}

// How many faces there will be.
double QuadMaker::quadrangulate_cells(std::optional<CellComplex>& cells) {
  if (!cells) {
    cells = load_cells(job_.store);
  }
  QuadrangulateReport report;
  PolygonMesh mesh = quadrangulate(std::move(*cells),
                                   {.side = side(), .pure_quads = job_.options.pure_quads}, report);
  cells.reset();
  erase_cells(job_.store);
  if (job_.keeps_loops()) {
    const bool clear = job_.field.features->has_clear_edges();
    reshape_short_loops(mesh, job_.boundary_curve(), job_.boundary_loops(),
                        (clear ? kShortClearLoop : kShortLoop) * job_.target.quad_side,
                        job_.curve_tolerance());
  }
  job_.remesh.set(std::move(mesh));
  save_lines(job_.store, omega_, density_);
  return refined_faces();
}

// About what dividing the curves will leave once vertices are in their places: bending creases
// outwards halves their distance.
double QuadMaker::refined_faces() {
  const PolygonMesh& mesh = job_.remesh.get();
  if (job_.options.pure_quads || job_.field.features->empty()) {
    return static_cast<double>(mesh.face_count());
  }
  PolygonMesh copy = mesh;
  const double tolerance = job_.curve_tolerance();
  refine_creases(copy, *job_.field.features, 2.0 * tolerance);
  if (job_.keeps_loops()) {
    refine_loops(copy, job_.boundary_curve(), job_.boundary_loops(), tolerance);
  }
  return static_cast<double>(copy.face_count());
}

}  // namespace rattan
