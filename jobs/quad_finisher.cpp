// SPDX-License-Identifier: MIT
#include "jobs/quad_finisher.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "engine/core/resident_memory.h"
#include "engine/remesh/mend_quads.h"
#include "engine/remesh/quadrangulate.h"
#include "engine/remesh/quality.h"
#include "engine/remesh/refine_creases.h"
#include "engine/remesh/refine_loops.h"
#include "engine/remesh/unfold.h"
#include "engine/remesh/untangle.h"
#include "engine/remesh/vertex_colours.h"

namespace rattan {

namespace {

// A quad with a corner of more than 143 degrees or less than 37 does better as two triangles: a few
// in a thousand are.
constexpr double kLeastJacobian = 0.6;
constexpr int kStepsAfterRefining = 20;
// Of the target, what may be exceeded by splitting quads that aren't folded.
constexpr double kMostFaces = 1.13;

double face_count(const PolygonMesh& mesh) {
  return static_cast<double>(mesh.face_count());
}

}  // namespace

void QuadFinisher::finish() {
  job_.clock.run("optimise", [&] {
    const PromptReturn prompt(job_.budget.tight());
    job_.steps.depend_on(fmt::format("pure-quads={} target={:a} crease={:a}",
                                     job_.options.pure_quads, job_.target.faces,
                                     job_.options.crease));
    job_.steps.before_long_step();
    faces_ = job_.remesh_step("places", [&] {
      place_vertices();
      return face_count(job_.remesh.get());
    });
    faces_ = job_.remesh_step("refinement", [&] {
      if (job_.options.pure_quads) {
        mend_quads();
      } else {
        refine_curves();
        divide_bad_quads();
      }
      return face_count(job_.remesh.get());
    });
    job_.steps.before_long_step();
    distance_ = job_.remesh_step("distance", [&] {
      PolygonMesh& mesh = job_.remesh.get();
      const DistanceReport distance = measure_distances(mesh, job_.store, job_.mesh, projector(),
                                                        DistanceOptions{}, job_.tasks);
      if (job_.mesh.has_colours) {
        transfer_colours(mesh, job_.store, job_.mesh, projector(), job_.tasks);
      }
      return distance;
    });
  });
}

double QuadFinisher::miss() const {
  return std::max(faces_ / job_.target.faces, job_.target.faces / faces_);
}

SurfaceProjector& QuadFinisher::projector() {
  if (!projector_) {
    projector_.emplace(job_.store, job_.mesh, ProjectorOptions{.budget = &job_.budget}, job_.tasks);
  }
  return *projector_;
}

OptimiseOptions QuadFinisher::optimise_options() const {
  OptimiseOptions options;
  options.features = job_.field.features.get();
  return options;
}

void QuadFinisher::place_vertices() {
  optimise(job_.remesh.get(), job_.store, job_.mesh, projector(), optimise_options(), job_.tasks);
}

// Divides creases and boundaries where they bend within an edge, then evens out the faces beside.
void QuadFinisher::refine_curves() {
  PolygonMesh& mesh = job_.remesh.get();
  const double tolerance = job_.curve_tolerance();
  std::uint64_t added = refine_creases(mesh, *job_.field.features, tolerance);
  if (job_.keeps_loops()) {
    added += unfold_ears(mesh);
    added += refine_loops(mesh, job_.boundary_curve(), job_.boundary_loops(), tolerance);
  }
  const bool clear_edges = job_.field.features->has_clear_edges();
  if (clear_edges) {
    added += unfold_faces(mesh);
  }
  if (added > 0) {
    OptimiseOptions options = optimise_options();
    options.hold_curves = true;
    options.steps = kStepsAfterRefining;
    optimise(mesh, job_.store, job_.mesh, projector(), options, job_.tasks);
    if (job_.keeps_loops()) {
      unfold_ears(mesh);
    }
    if (clear_edges) {
      unfold_faces(mesh);
    }
  }
}

// As many as leave the number of faces near to what was asked for.
void QuadFinisher::divide_bad_quads() {
  const PolygonMesh& mesh = job_.remesh.get();
  PolygonMesh divided;
  for (const double least : {kLeastJacobian, 0.5, 0.4, 0.3, 0.2, 0.0}) {
    divided = mesh;
    split_bad_quads(divided, least);
    if (face_count(divided) <= kMostFaces * job_.target.faces) {
      break;
    }
  }
  job_.remesh.set(std::move(divided));
}

// A folded quad can't become two triangles here: it is moved, or others take its place, as long as
// the mesh has the faces that were asked for.
void QuadFinisher::mend_quads() {
  PolygonMesh& mesh = job_.remesh.get();
  UntangleOptions options;
  options.features = job_.field.features.get();
  if (quads_not_above(mesh, options.least).empty()) {
    return;
  }
  if (job_.mesh.topology.boundary_loops > 0) {
    options.boundary = &job_.boundary_curve();
  }
  const bool had_met = meets_target(face_count(mesh), job_.target);
  mend_until_good(mesh, projector(), options, job_.tasks, [&](std::size_t faces) {
    return !had_met || meets_target(static_cast<double>(faces), job_.target);
  });
}

}  // namespace rattan
