// SPDX-License-Identifier: MIT
#include "jobs/remesh_job.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <fmt/format.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include "engine/layout/arrangement.h"
#include "engine/mesh/ingest.h"
#include "engine/mesh/scan_record.h"
#include "engine/param/parameterize.h"
#include "engine/remesh/distance.h"
#include "engine/remesh/mend_quads.h"
#include "engine/remesh/optimise.h"
#include "engine/remesh/quadrangulate.h"
#include "engine/remesh/quality.h"
#include "engine/remesh/refine_creases.h"
#include "engine/remesh/refine_loops.h"
#include "engine/remesh/topology.h"
#include "engine/remesh/vertex_colours.h"
#include "io/remesh/remesh_writer.h"
#include "io/scan/field_reader.h"
#include "io/scan/scan_reader.h"
#include "io/store/hdf5_store.h"
#include "jobs/memory_share.h"
#include "jobs/output_names.h"
#include "jobs/preview.h"
#include "jobs/repair_warnings.h"
#include "jobs/size_list.h"
#include "jobs/size_plan.h"
#include "jobs/size_search.h"
#include "jobs/stage_clock.h"
#include "jobs/target_size.h"
#include "jobs/version.h"
#include "jobs/work_record.h"

namespace rattan {

namespace {

/// Keeps the warnings for the report on their way to the caller.
class RecordingProgress final : public ProgressSink {
 public:
  RecordingProgress(ProgressSink& next, std::vector<std::string>& warnings)
      : next_(next), warnings_(warnings) {}
  void progress(std::string_view stage, std::uint64_t done, std::uint64_t total) override {
    next_.progress(stage, done, total);
  }
  void warning(const std::string& sentence) override {
    warnings_.push_back(sentence);
    next_.warning(sentence);
  }

 private:
  ProgressSink& next_;
  std::vector<std::string>& warnings_;
};

/// The stages of one scan, in order; what they share.
class RemeshJob {
 public:
  RemeshJob(const RemeshOptions& options, ProgressSink& progress)
      : options_(options.resolved()),
        names_(output_names(options_)),
        previews_(options_.preview.empty()
                      ? std::vector<std::string>(names_.size())
                      : expand_names(options_.preview, options_.size_kind, options_.sizes)),
        progress_(progress, report_.warnings),
        threads_(options.threads > 0 ? options.threads
                                     : oneapi::tbb::this_task_arena::max_concurrency()),
        parallelism_(oneapi::tbb::global_control::max_allowed_parallelism,
                     static_cast<std::size_t>(threads_)),
        memory_(options.memory > 0 ? options.memory : default_memory_share()),
        budget_(memory_),
        store_({.directory = options.work_dir.empty() ? names_[0] + ".work" : options.work_dir,
                .cache_bytes = memory_,
                .budget = &budget_,
                .keep = options.keep_work}),
        tasks_({.threads = threads_}, &progress_),
        clock_(
            tasks_,
            [this] {
              return StageClock::StoreTraffic{store_.bytes_read(), store_.bytes_written()};
            },
            report_.stages) {}

  RemeshReport run() {
    const double start = wall_seconds();
    clock_.run("ingest", [&] { ingest(); });
    report_.outputs.resize(names_.size());
    std::vector<double> faces;
    for (const double size : options_.sizes) {
      faces.push_back(target_size(options_.size_kind, size, mesh_).faces);
    }
    for (const PlannedSize& planned : plan_sizes(faces, options_.density)) {
      make_size(planned);
    }
    finish_report(start);
    return std::move(report_);
  }

 private:
  /// One remesh, from the scan in the store to the file.
  void make_size(const PlannedSize& planned) {
    current_ = planned.size;
    report_.output = {};
    target_ = target_size(options_.size_kind, options_.sizes[current_], mesh_);
    if (!extract_from_shared(planned)) {
      clock_.run("field", [&] { compute_fields(); });
      extract_to_size();
      owner_ = current_;
    }
    clock_.run("optimise", [&] { optimise_positions(); });
    if (owner_ == current_) {
      correct_size();
    }
    clock_.run("verify", [&] { verify(); });
    clock_.run("write", [&] { write(); });
    if (!options_.preview.empty()) {
      clock_.run("preview", [&] {
        write_preview({.store = store_,
                       .scan = mesh_,
                       .remesh = &remesh_,
                       .omega = omega_,
                       .density = density_},
                      previews_[current_]);
      });
    }
    if (options_.keep_work) {
      save_work(store_, remesh_, omega_, density_);
    }
    finish_size();
  }

  void ingest() {
    IngestOptions options;
    options.tile_size = options_.tile_size;
    options.memory_bytes = memory_ / 4;
    options.input_name = options_.scan;
    options.merge = options_.merge_vertices ? Merge::kAlways : Merge::kSoup;
    options.drop_components = options_.drop_components;
    options.fill_holes = options_.fill_holes;
    Ingest ingest(store_, options);
    ScanFileInfo info;
    info.want_sha256 = true;
    read_scan(options_.scan, ingest, &info, {.memory_bytes = memory_ / 2});
    if (!options_.field.empty()) {
      field_hash_ =
          read_field(options_.field, ingest.vertex_count(),
                     [&](std::span<const VertexDirection> d) { ingest.add_directions(d); });
    }
    mesh_ = ingest.finish(tasks_);
    save_scan_mesh(store_, mesh_);
    store_.complete_stage("mesh");
    report_.input.sha256 = info.sha256;
    warn_of_repairs(options_.scan, mesh_.repaired, progress_);
  }

  void compute_fields() {
    FieldOptions options;
    // For pure quads the field is as smooth as the lines of the parameterization are far apart,
    // since each of its singularities costs.
    options.quad_side = target_.quad_side * (options_.pure_quads ? 0.75 * options_.density : 1.0);
    options.energy = options_.energy == Energy::kEdge ? EdgeEnergy::kEdge : EdgeEnergy::kTriangle;
    options.symmetry = static_cast<Symmetry>(options_.symmetry);
    options.smoothing = options_.smoothing;
    options.curl_power = options_.curl_correction ? 1.0 : 0.2;
    options.features.creases = options_.crease > 0.0;
    options.features.crease_degrees = options_.crease;
    field_ = compute_field(store_, mesh_, options, tasks_, owner_ ? &field_ : nullptr);
    store_.complete_stage("field");
  }

  // Draws the lines of this size in the coarser parameterization that is still there; false if
  // there is none or the face count isn't met.
  bool extract_from_shared(const PlannedSize& planned) {
    if (!planned.owner || planned.owner != owner_) {
      return false;
    }
    density_ = planned.multiple * options_.density;
    if (!extract_quads(most_faces())) {
      return false;
    }
    return meets_target(refined_faces(), target_);
  }

  // The fields of a try replace those of the one before, so where an earlier one was the best, it
  // is made again: report and preview then show the mesh that is written.
  void extract_to_size() {
    SizeSearch search(target_.faces, first_side());
    double made = 0.0;
    while (!search.done()) {
      const double side = search.side();
      if (quads_at(side, most_faces())) {
        made = side;
        search.tell(refined_faces());
        continue;
      }
      made = 0.0;
      if (std::isfinite(expected_faces_)) {
        search.tell(expected_faces_);
      } else {
        search.tell_more_than(most_faces());
      }
    }
    if (search.best_side() != made) {
      quads_at(search.best_side(), std::numeric_limits<double>::infinity());
    }
    expected_to_meet_ = meets_target(refined_faces(), target_);
  }

  // On spikes much thinner than a quad, lines cross each other thousands of times more often than
  // the area says. A try this far off only has to say so: its faces needn't be made.
  double most_faces() const { return 2e4 + 8.0 * target_.faces; }

  // Lines are laid on the low-passed surface, which is smaller than the scan by as much as there is
  // noise and relief; with its area the first solve meets the count within 2 % on most scans.
  double first_side() const {
    const double share = mesh_.area > 0.0 ? field_.area / mesh_.area : 1.0;
    return target_.quad_side * std::sqrt(std::clamp(share, 0.1, 1.5));
  }

  bool quads_at(double side, double most) {
    density_ = options_.density;
    omega_ = side * density_;
    clock_.run("parameterize", [&] {
      ParamOptions options;
      options.omega = omega_;
      options.density = options_.density;
      options.solve.newton_steps = options_.newton_steps;
      options.reference = options_.solver == SolverKind::kReference;
      phase_report_ = parameterize(store_, mesh_, field_, options, tasks_);
    });
    return extract_quads(most);
  }

  // Makes remesh_, unless more than `most` faces are to be expected of the cells.
  bool extract_quads(double most) {
    // A mesh of quads has as many vertices as faces, and each is a crossing.
    constexpr double kCrossings = 4.0;
    ArrangementOptions options{
        .omega = omega_, .density = density_, .features = field_.features.get()};
    if (std::isfinite(most)) {
      options.most_crossings = static_cast<std::uint64_t>(kCrossings * most);
    }
    CellComplex cells;
    try {
      cells = clock_.run(
          "extract", [&] { return extract_cells(store_, mesh_, options, tasks_, arrangement_); });
    } catch (const TooManyCrossings&) {
      expected_faces_ = std::numeric_limits<double>::infinity();
      return false;
    }
    expected_faces_ = expected_faces(cells);
    if (expected_faces_ > most) {
      return false;
    }
    remesh_ = clock_.run("quadrangulate", [&] {
      QuadrangulateReport report;
      PolygonMesh mesh = quadrangulate(
          std::move(cells), {.side = omega_ / density_, .pure_quads = options_.pure_quads}, report);
      if (keeps_loops()) {
        if (!curve_) {
          curve_.emplace(store_, mesh_, tasks_);
          loops_.emplace(*curve_);
        }
        reshape_short_loops(mesh, *curve_, *loops_, kShortLoop * target_.quad_side,
                            kCurveTolerance * mesh_.diagonal());
      }
      return mesh;
    });
    return true;
  }

  bool keeps_loops() const { return !options_.pure_quads && mesh_.topology.boundary_loops > 0; }

  double final_faces() const { return static_cast<double>(remesh_.face_count()); }

  // About what dividing the curves will leave once vertices are in their places: bending creases
  // outwards halves their distance.
  double refined_faces() const {
    if (options_.pure_quads || field_.features->empty()) {
      return final_faces();
    }
    PolygonMesh copy = remesh_;
    const double tolerance = kCurveTolerance * mesh_.diagonal();
    refine_creases(copy, *field_.features, 2.0 * tolerance);
    if (keeps_loops()) {
      refine_loops(copy, *curve_, *loops_, tolerance);
    }
    return static_cast<double>(copy.face_count());
  }

  OptimiseOptions optimise_options() const {
    OptimiseOptions options;
    options.features = field_.features.get();
    return options;
  }

  void optimise_positions() {
    projector_.emplace(store_, mesh_, ProjectorOptions{}, tasks_);
    optimise(remesh_, store_, mesh_, *projector_, optimise_options(), tasks_);
    if (options_.pure_quads) {
      mend_quads();
    } else {
      refine_curves();
      divide_bad_quads();
    }
    report_.distance =
        measure_distances(remesh_, store_, mesh_, *projector_, DistanceOptions{}, tasks_);
    if (mesh_.has_colours) {
      transfer_colours(remesh_, store_, mesh_, *projector_, tasks_);
    }
  }

  // Divides creases and boundaries where they bend within an edge, then evens out the faces beside.
  void refine_curves() {
    const double tolerance = kCurveTolerance * mesh_.diagonal();
    std::uint64_t added = refine_creases(remesh_, *field_.features, tolerance);
    if (keeps_loops()) {
      added += unfold_ears(remesh_);
      added += refine_loops(remesh_, *curve_, *loops_, tolerance);
    }
    if (added > 0) {
      OptimiseOptions options = optimise_options();
      options.hold_curves = true;
      options.steps = kStepsAfterRefining;
      optimise(remesh_, store_, mesh_, *projector_, options, tasks_);
      if (keeps_loops()) {
        unfold_ears(remesh_);
      }
    }
  }

  // As many as leave the number of faces near to what was asked for.
  void divide_bad_quads() {
    PolygonMesh divided;
    for (const double least : {kLeastJacobian, 0.5, 0.4, 0.3, 0.2, 0.0}) {
      divided = remesh_;
      split_bad_quads(divided, least);
      if (static_cast<double>(divided.face_count()) <= kMostFaces * target_.faces) {
        break;
      }
    }
    remesh_ = std::move(divided);
  }

  // Where curves took so many more faces than expected that the target is missed, all is made again
  // with larger quads; what comes nearest is kept.
  void correct_size() {
    constexpr int kRounds = 2;
    for (int round = 0; round < kRounds && expected_to_meet_ && !met(); ++round) {
      const double side = omega_ / density_;
      const double miss = size_miss();
      const auto make = [&](double at) {
        quads_at(at, std::numeric_limits<double>::infinity());
        clock_.run("optimise", [&] { optimise_positions(); });
      };
      make(side * std::sqrt(final_faces() / target_.faces));
      if (size_miss() >= miss) {
        make(side);
        return;
      }
    }
  }
  bool met() const { return meets_target(final_faces(), target_); }
  double size_miss() const {
    return std::max(final_faces() / target_.faces, target_.faces / final_faces());
  }

  // A folded quad can't become two triangles here: more untangling, then other quads in its place.
  // The mesh with fewest of them is kept, as long as it has the faces that were asked for.
  void mend_quads() {
    constexpr int kRounds = 4;
    std::uint64_t fewest = measure_quality(remesh_).bad_quads;
    PolygonMesh mended = fewest > 0 ? remesh_ : PolygonMesh();
    for (int round = 0; round < kRounds && fewest > 0; ++round) {
      OptimiseOptions options = optimise_options();
      if (round == 0) {
        options.steps = 0;
        options.relocate = false;
      } else {
        mend_bad_quads(mended);
      }
      options.untangle_rounds = 12;
      optimise(mended, store_, mesh_, *projector_, options, tasks_);
      const std::uint64_t left = measure_quality(mended).bad_quads;
      const auto faces = static_cast<double>(mended.face_count());
      if (left < fewest &&
          (meets_target(faces, target_) || !meets_target(final_faces(), target_))) {
        fewest = left;
        remesh_ = mended;
      }
    }
  }

  // The promises are checked on the mesh itself before it is written; the writer compares what it
  // wrote with this mesh.
  void verify() {
    const MeshTopology t = check_topology(remesh_);
    ensure(t.clean(), "the remesh is a simple manifold mesh");
    ensure(t.components == mesh_.topology.components &&
               t.boundary_loops == mesh_.topology.boundary_loops &&
               t.euler() == mesh_.topology.euler(),
           "the remesh has the scan's components, boundary loops and Euler characteristic");
    report_.output.components = t.components;
    report_.output.boundary_loops = t.boundary_loops;
    report_.output.euler = t.euler();
    const MeshQuality q = measure_quality(remesh_);
    report_.output.quads = q.quads;
    report_.output.triangles = q.triangles;
    report_.output.interior_vertices = q.interior_vertices;
    report_.output.irregular_vertices = q.irregular_vertices;
    report_.output.bad_quads = q.bad_quads;
    report_.output.mean_scaled_jacobian = q.mean_scaled_jacobian;
    report_.output.min_scaled_jacobian = q.min_scaled_jacobian;
    report_.output.mean_corner_deviation = q.mean_corner_deviation;
    report_.output.edge_length_variation = q.edge_length_variation;
    if (options_.pure_quads) {
      ensure(q.triangles == 0, "a mesh of pure quads has no triangles");
      if (q.bad_quads > 0) {
        progress_.warning(
            fmt::format("{}: {} quads are folded or have a flat corner, as the scan's relief there "
                        "is finer than a quad. More faces, or triangles, avoid that.",
                        names_[current_], q.bad_quads));
      }
    }
    report_.output.target_faces = target_.faces;
    report_.output.target_met = met();
    if (!report_.output.target_met) {
      progress_.warning(
          fmt::format("{}: {} faces instead of {:.0f}: the nearest that the scan's "
                      "topology and relief allow.",
                      names_[current_], remesh_.face_count(), target_.faces));
    }
  }

  void write() {
    RemeshMetadata metadata;
    metadata.version = version();
    metadata.options = options_.canonical(options_.sizes[current_]);
    if (!field_hash_.empty()) {
      metadata.options += " field=" + field_hash_;
    }
    if (owner_ != current_) {
      metadata.options += fmt::format(" lines-of={}", size_text(options_.sizes[*owner_]));
    }
    metadata.input_hash = report_.input.sha256;
    metadata.origin = mesh_.origin;
    WriteOptions options;
    options.position_bits = options_.position_bits;
    if (mesh_.unit != 1.0) {
      for (Vec3d& p : remesh_.positions) {
        p *= mesh_.unit;
      }
    }
    const WriteResult written = write_remesh(remesh_, metadata, names_[current_], options);
    if (mesh_.unit != 1.0) {  // a picture comes yet
      for (Vec3d& p : remesh_.positions) {
        p /= mesh_.unit;
      }
    }
    report_.output.bytes = written.bytes;
    report_.output.vertices = written.vertices;
    report_.output.faces = written.faces;
    report_.output.origin = written.origin;
  }

  void finish_size() {
    projector_.reset();
    report_.output.path = names_[current_];
    const SingularityCounts& s = arrangement_.singularities;
    report_.singularities = {s.vertices, s.edges,
                             s.field_triangles + s.phase_triangles + s.negative_triangles};
    report_.outputs[current_] = {report_.output, report_.singularities, report_.distance,
                                 owner_ == current_ ? std::string() : names_[*owner_]};
    if (owner_ == current_) {
      report_.solver.insert(report_.solver.end(), field_.reports.begin(), field_.reports.end());
      report_.solver.push_back(phase_report_);
    }
  }

  void finish_report(double start) {
    report_.options = options_;
    report_.input.path = options_.scan;
    report_.input.topology = mesh_.topology;
    report_.input.repaired = mesh_.repaired;
    report_.output = report_.outputs[0].output;
    report_.singularities = report_.outputs[0].singularities;
    report_.distance = report_.outputs[0].distance;
    report_.peak_rss_bytes = peak_rss_bytes();
    report_.memory_budget_bytes = memory_;
    report_.threads = threads_;
    report_.seconds = wall_seconds() - start;
    if (!options_.report.empty()) {
      write_report(report_, options_.report);
    }
  }

  // A quad with a corner of more than 143 degrees or less than 37 does better as two triangles: a
  // few in a thousand are.
  static constexpr double kLeastJacobian = 0.6;
  // Sharp edges and smooth boundaries come back within a thousandth of the scan's diagonal.
  static constexpr double kCurveTolerance = 0.85e-3;
  static constexpr int kStepsAfterRefining = 20;
  // Of the target, what may be exceeded by splitting quads that aren't folded.
  static constexpr double kMostFaces = 1.13;
  // Boundary loops shorter than this, in quad sides, get their vertices before all else.
  static constexpr double kShortLoop = 12.0;

  RemeshReport report_;
  const RemeshOptions options_;
  const std::vector<std::string> names_;     ///< one a size
  const std::vector<std::string> previews_;  ///< likewise
  RecordingProgress progress_;
  int threads_;
  oneapi::tbb::global_control parallelism_;
  std::uint64_t memory_;
  MemoryBudget budget_;
  Hdf5Store store_;
  TaskGraph tasks_;
  StageClock clock_;

  ScanMesh mesh_;
  std::string field_hash_;            ///< of the file of directions; empty: none
  std::size_t current_ = 0;           ///< which size is being made
  std::optional<std::size_t> owner_;  ///< the size whose field and phases the store holds
  TargetSize target_;
  SurfaceField field_;
  double omega_ = 0.0;
  double expected_faces_ = 0.0;  ///< of the cells made last; infinite if lines cross too often
  int density_ = 2;              ///< lines a period, of the size being made
  SolveReport phase_report_;
  ArrangementReport arrangement_;
  PolygonMesh remesh_;
  bool expected_to_meet_ = false;       ///< before the curves were divided
  std::optional<BoundaryCurve> curve_;  ///< of the scan, once it is needed
  std::optional<BoundaryLoops> loops_;
  std::optional<SurfaceProjector> projector_;
};

}  // namespace

RemeshReport remesh_scan(const RemeshOptions& options, ProgressSink& progress) {
  return RemeshJob(options, progress).run();
}

}  // namespace rattan
