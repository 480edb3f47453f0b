// SPDX-License-Identifier: MIT
#include "jobs/remesh_job.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>

#include <fmt/format.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include "engine/layout/arrangement.h"
#include "engine/mesh/ingest.h"
#include "engine/param/parameterize.h"
#include "engine/remesh/distance.h"
#include "engine/remesh/optimise.h"
#include "engine/remesh/quadrangulate.h"
#include "engine/remesh/quality.h"
#include "engine/remesh/refine_creases.h"
#include "engine/remesh/topology.h"
#include "io/remesh/remesh_writer.h"
#include "io/scan/scan_reader.h"
#include "io/store/hdf5_store.h"
#include "jobs/memory_share.h"
#include "jobs/preview.h"
#include "jobs/stage_clock.h"
#include "jobs/target_size.h"
#include "jobs/version.h"

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
      : options_(options),
        progress_(progress, report_.warnings),
        threads_(options.threads > 0 ? options.threads
                                     : oneapi::tbb::this_task_arena::max_concurrency()),
        parallelism_(oneapi::tbb::global_control::max_allowed_parallelism,
                     static_cast<std::size_t>(threads_)),
        memory_(options.memory > 0 ? options.memory : default_memory_share()),
        store_({.directory = options.work_dir.empty() ? options.output + ".work" : options.work_dir,
                .cache_bytes = memory_ / 2,
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
    check_output();
    clock_.run("ingest", [&] { ingest(); });
    target_ = target_size(options_, mesh_);
    clock_.run("field", [&] { compute_fields(); });
    extract_to_size();
    clock_.run("optimise", [&] { optimise_positions(); });
    clock_.run("verify", [&] { verify(); });
    clock_.run("write", [&] { write(); });
    if (!options_.preview.empty()) {
      clock_.run("preview", [&] {
        write_preview({.store = store_,
                       .scan = mesh_,
                       .remesh = remesh_,
                       .omega = omega_,
                       .density = options_.density},
                      options_.preview);
      });
    }
    finish_report(start);
    return std::move(report_);
  }

 private:
  void check_output() const {
    namespace fs = std::filesystem;
    const fs::path path(options_.output);
    const std::string extension = path.extension().string();
    if (extension != ".drc" && extension != ".obj" && extension != ".ply" && extension != ".off") {
      throw UsageError(options_.output +
                       ": the extension says which format to write. Use .drc, "
                       ".obj, .ply or .off.");
    }
    const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    std::error_code ignored;
    if (!fs::is_directory(folder, ignored)) {
      throw UsageError(folder.string() + ": there is no such folder to write " + options_.output +
                       " into. Create it first.");
    }
  }

  void ingest() {
    IngestOptions options;
    options.tile_size = options_.tile_size;
    options.memory_bytes = memory_ / 4;
    options.input_name = options_.scan;
    Ingest ingest(store_, options);
    ScanFileInfo info;
    info.want_sha256 = true;
    read_scan(options_.scan, ingest, &info);
    mesh_ = ingest.finish(tasks_);
    store_.complete_stage("mesh");
    report_.input.sha256 = info.sha256;
    if (mesh_.repaired.non_manifold_edges + mesh_.repaired.split_vertices > 0) {
      progress_.warning(fmt::format(
          "{}: {} non-manifold edges were cut open and {} vertices split; see input.repaired in "
          "the report.",
          options_.scan, mesh_.repaired.non_manifold_edges, mesh_.repaired.split_vertices));
    }
  }

  void compute_fields() {
    FieldOptions options;
    options.quad_side = target_.quad_side;
    options.energy = options_.energy == Energy::kEdge ? EdgeEnergy::kEdge : EdgeEnergy::kTriangle;
    options.symmetry = static_cast<Symmetry>(options_.symmetry);
    options.smoothing = options_.smoothing;
    options.curl_power = options_.curl_correction ? 1.0 : 0.2;
    options.features.creases = options_.crease > 0.0;
    options.features.crease_degrees = options_.crease;
    field_ = compute_field(store_, mesh_, options, tasks_);
    store_.complete_stage("field");
  }

  // The face count follows from the density of lines up to what singularities, boundaries and small
  // components take away, so one solve usually lands within the promise. If not, the density is
  // corrected by what came out. The fields of a try replace those of the one before, so where an
  // earlier one was the best, it is made again: report and preview then show the mesh that is
  // written.
  void extract_to_size() {
    constexpr int kTries = 3;
    constexpr double kGoodEnough = 0.08;
    const auto miss = [this] {
      return std::abs(std::log(static_cast<double>(remesh_.face_count()) / target_.faces));
    };
    double side = target_.quad_side * kFirstGuess;
    double best_side = side;
    double best_miss = std::numeric_limits<double>::infinity();
    for (int attempt = 0; attempt < kTries; ++attempt) {
      remesh_ = quads_at(side);
      if (miss() < best_miss) {
        best_miss = miss();
        best_side = side;
      }
      if (best_miss < kGoodEnough || attempt + 1 == kTries) {
        break;
      }
      side *= std::sqrt(static_cast<double>(remesh_.face_count()) / target_.faces);
    }
    if (best_side != side) {
      remesh_ = quads_at(best_side);
    }
  }

  PolygonMesh quads_at(double side) {
    omega_ = side * options_.density;
    clock_.run("parameterize", [&] {
      ParamOptions options;
      options.omega = omega_;
      options.density = options_.density;
      options.solve.newton_steps = options_.newton_steps;
      options.reference = options_.solver == SolverKind::kReference;
      phase_report_ = parameterize(store_, mesh_, field_, options, tasks_);
    });
    CellComplex cells = clock_.run("extract", [&] {
      return extract_cells(
          store_, mesh_,
          {.omega = omega_, .density = options_.density, .features = field_.features.get()}, tasks_,
          arrangement_);
    });
    return clock_.run("quadrangulate", [&] {
      QuadrangulateReport report;
      return quadrangulate(std::move(cells), {.side = side}, report);
    });
  }

  void optimise_positions() {
    projector_.emplace(store_, mesh_, ProjectorOptions{}, tasks_);
    optimise(remesh_, store_, mesh_, *projector_, {.features = field_.features.get()}, tasks_);
    refine_creases(remesh_, *field_.features, kCreaseTolerance * mesh_.diagonal());
    split_bad_quads(remesh_);
    report_.distance =
        measure_distances(remesh_, store_, mesh_, *projector_, DistanceOptions{}, tasks_);
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
    report_.output.mean_scaled_jacobian = q.mean_scaled_jacobian;
    report_.output.min_scaled_jacobian = q.min_scaled_jacobian;
    report_.output.mean_corner_deviation = q.mean_corner_deviation;
    report_.output.edge_length_variation = q.edge_length_variation;
    report_.output.target_faces = target_.faces;
    report_.output.target_met = meets_target(static_cast<double>(remesh_.face_count()), target_);
    if (!report_.output.target_met) {
      progress_.warning(
          fmt::format("{}: {} faces instead of {:.0f}: the nearest that the scan's "
                      "topology and relief allow.",
                      options_.output, remesh_.face_count(), target_.faces));
    }
  }

  void write() {
    RemeshMetadata metadata;
    metadata.version = version();
    metadata.options = options_.canonical();
    metadata.input_hash = report_.input.sha256;
    metadata.origin = mesh_.origin;
    WriteOptions options;
    options.position_bits = options_.position_bits;
    const WriteResult written = write_remesh(remesh_, metadata, options_.output, options);
    report_.output.bytes = written.bytes;
    report_.output.vertices = written.vertices;
    report_.output.faces = written.faces;
    report_.output.origin = written.origin;
  }

  void finish_report(double start) {
    report_.options = options_;
    report_.input.path = options_.scan;
    report_.input.topology = mesh_.topology;
    report_.input.repaired = mesh_.repaired;
    report_.output.path = options_.output;
    const SingularityCounts& s = arrangement_.singularities;
    report_.singularities = {s.vertices, s.edges,
                             s.field_triangles + s.phase_triangles + s.negative_triangles};
    report_.solver = field_.reports;
    report_.solver.push_back(phase_report_);
    report_.peak_rss_bytes = peak_rss_bytes();
    report_.memory_budget_bytes = memory_;
    report_.threads = threads_;
    report_.seconds = wall_seconds() - start;
    if (!options_.report.empty()) {
      write_report(report_, options_.report);
    }
  }

  // Singularities and boundaries take a little of the faces away.
  static constexpr double kFirstGuess = 0.99;
  // Sharp edges come back within a thousandth of the scan's diagonal.
  static constexpr double kCreaseTolerance = 0.85e-3;

  RemeshReport report_;
  const RemeshOptions& options_;
  RecordingProgress progress_;
  int threads_;
  oneapi::tbb::global_control parallelism_;
  std::uint64_t memory_;
  Hdf5Store store_;
  TaskGraph tasks_;
  StageClock clock_;

  ScanMesh mesh_;
  TargetSize target_;
  SurfaceField field_;
  double omega_ = 0.0;
  SolveReport phase_report_;
  ArrangementReport arrangement_;
  PolygonMesh remesh_;
  std::optional<SurfaceProjector> projector_;
};

}  // namespace

RemeshReport remesh_scan(const RemeshOptions& options, ProgressSink& progress) {
  return RemeshJob(options, progress).run();
}

}  // namespace rattan
