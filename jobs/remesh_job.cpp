// SPDX-License-Identifier: MIT
#include "jobs/remesh_job.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <fmt/format.h>

#include "engine/core/resident_memory.h"
#include "engine/remesh/quality.h"
#include "engine/remesh/topology.h"
#include "io/remesh/remesh_writer.h"
#include "jobs/job_context.h"
#include "jobs/memory_plan.h"
#include "jobs/output_names.h"
#include "jobs/page_files.h"
#include "jobs/preview.h"
#include "jobs/quad_finisher.h"
#include "jobs/quad_maker.h"
#include "jobs/scan_job.h"
#include "jobs/size_list.h"
#include "jobs/size_plan.h"
#include "jobs/target_size.h"
#include "jobs/version.h"
#include "jobs/work_record.h"

namespace rattan {

namespace {

/// Figures of a remesh that is ready to be written.
struct Verified {
  MeshTopology topology;
  MeshQuality quality;
};

class RemeshJob : public ScanJob {
 public:
  RemeshJob(const RemeshOptions& options, const JobPlace& place, const JobAttempt& attempt)
      : ScanJob(options, place, attempt),
        options_(options),
        names_(output_names(options_)),
        previews_(options_.preview.empty()
                      ? std::vector<std::string>(names_.size())
                      : expand_names(options_.preview, options_.size_kind, options_.sizes)),
        job_(options_, budget_, store_, tasks_, clock_, steps_),
        maker_(job_),
        finisher_(job_) {}

  RemeshReport run() {
    check_memory(memory_wish(0, asked_faces(options_, 0)), memory_, options_.scan);
    process_memory_ = budget_.reserve(memory_need({.threads = threads_}, memory_).total(),
                                      "the program and tiles at work");
    clock_.run("ingest", [&] { job_.mesh = ingest(); });
    report_.outputs.resize(names_.size());
    std::vector<double> faces;
    for (const double size : options_.sizes) {
      faces.push_back(target_size(options_.size_kind, size, job_.mesh).faces);
    }
    const double most = *std::max_element(faces.begin(), faces.end());
    check_memory(memory_wish(job_.mesh.topology.vertices, most), memory_, options_.scan);
    scan_memory_ =
        budget_.reserve(memory_need(memory_wish(job_.mesh.topology.vertices, 0.0), memory_).scan,
                        "the scan's tables");
    for (const PlannedSize& planned : plan_sizes(faces, options_.density)) {
      make_size(planned);
    }
    if (options_.keep_work) {
      steps_.save();
    }
    finish_report();
    steps_.check_ours();  // before the work is deleted
    store_.set_keep(options_.keep_work);
    return std::move(report_);
  }

 private:
  MemoryWish memory_wish(std::uint64_t vertices, double faces) const {
    return {.vertices = vertices,
            .faces = faces,
            .threads = threads_,
            .picture = !options_.preview.empty()};
  }

  /// One remesh, from the scan in the store to the file.
  void make_size(const PlannedSize& planned) {
    current_ = planned.size;
    report_.output = {};
    job_.target = target_size(options_.size_kind, options_.sizes[current_], job_.mesh);
    store_.set_note(kOptionsNote, options_.canonical(options_.sizes[current_]));
    const bool shared = planned.owner && planned.owner == owner_ &&
                        maker_.make_from_last(planned.multiple * options_.density);
    if (!shared) {
      clock_.run("field", [&] { compute_fields(); });
      maker_.make_to_size();
      expected_to_meet_ = maker_.expected_to_meet();
      owner_ = current_;
    }
    finisher_.finish();
    if (owner_ == current_) {
      correct_size();
    }
    clock_.run("verify", [&] { verify(); });
    clock_.run("write", [&] { write(); });
    if (!options_.preview.empty()) {
      clock_.run("preview", [&] { preview(); });
    }
    if (!options_.thumbnail.empty() || !options_.viewer.empty()) {
      clock_.run("page files", [&] { write_for_page(job_, finisher_, current_); });
    }
    finish_size();
  }

  void compute_fields() {
    FieldOptions options;
    // For pure quads the field is as smooth as the lines of the parameterization are far apart,
    // since each of its singularities costs.
    options.quad_side =
        job_.target.quad_side * (options_.pure_quads ? 0.75 * options_.density : 1.0);
    options.energy = options_.energy == Energy::kEdge ? EdgeEnergy::kEdge : EdgeEnergy::kTriangle;
    options.symmetry = static_cast<Symmetry>(options_.symmetry);
    options.smoothing = options_.smoothing;
    options.curl_power = options_.curl_correction ? 1.0 : 0.2;
    options.features.creases = options_.crease > 0.0;
    options.features.crease_degrees = options_.crease;
    options.features.tolerance = job_.curve_tolerance();
    // Quads alone fit beside none.
    options.features.most_corners =
        options_.pure_quads ? 0 : static_cast<std::size_t>(kMostCorners * job_.target.faces);
    steps_.depend_on(
        fmt::format("quad-side={:a} energy={} symmetry={} smoothing={:a} curl={:a} "
                    "crease={:a} corners={}",
                    options.quad_side, static_cast<int>(options.energy), options_.symmetry,
                    options.smoothing.value_or(-1.0), options.curl_power, options_.crease,
                    options.features.most_corners));
    job_.field = compute_field(store_, job_.mesh, options, tasks_, owner_ ? &job_.field : nullptr);
  }

  // Where curves took so many more faces than expected that the target is missed, all is made again
  // with larger quads; what comes nearest is kept.
  void correct_size() {
    constexpr int kRounds = 4;
    const bool worth_it = expected_to_meet_ || job_.field.features->has_clear_edges();
    double best_side = maker_.side();
    double least_miss = finisher_.miss();
    double made = best_side;
    const auto make = [&](double side) {
      made = side;
      maker_.make_at(side, std::numeric_limits<double>::infinity());
      finisher_.finish();
    };
    for (int round = 0; round < kRounds && worth_it && !finisher_.met(); ++round) {
      // What curves take doesn't change with the side: more than the square root of the miss.
      make(made * finisher_.faces() / job_.target.faces);
      if (finisher_.miss() < least_miss) {
        least_miss = finisher_.miss();
        best_side = made;
      }
    }
    if (made != best_side) {
      make(best_side);
    }
  }

  // The promises are checked on the mesh itself before it is written; the writer compares what it
  // wrote with this mesh.
  void verify() {
    steps_.depend_on(fmt::format("pure-quads={}", options_.pure_quads));
    const PromptReturn prompt(budget_.tight());
    const Verified v = steps_.run("verify", [&] {
      const PolygonMesh& remesh = job_.remesh.get();
      return Verified{check_topology(remesh), measure_quality(remesh)};
    });
    const MeshTopology& t = v.topology;
    const ScanTopology& scan = job_.mesh.topology;
    ensure(t.clean(), "the remesh is a simple manifold mesh");
    ensure(t.components == scan.components && t.boundary_loops == scan.boundary_loops &&
               t.euler() == scan.euler(),
           "the remesh has the scan's components, boundary loops and Euler characteristic");
    report_.output.components = t.components;
    report_.output.boundary_loops = t.boundary_loops;
    report_.output.euler = t.euler();
    const MeshQuality& q = v.quality;
    report_.output.quads = q.quads;
    report_.output.triangles = q.triangles;
    report_.output.interior_vertices = q.interior_vertices;
    report_.output.irregular_vertices = q.irregular_vertices;
    report_.output.bad_quads = q.bad_quads;
    report_.output.mean_scaled_jacobian = q.mean_scaled_jacobian;
    report_.output.min_scaled_jacobian = q.min_scaled_jacobian;
    report_.output.mean_corner_deviation = q.mean_corner_deviation;
    report_.output.edge_length_variation = q.edge_length_variation;
    report_.output.stretch = q.stretch;
    report_.output.shear = q.shear;
    if (options_.pure_quads) {
      ensure(q.triangles == 0, "a mesh of pure quads has no triangles");
      if (q.bad_quads > 0) {
        progress_.warning(
            fmt::format("{}: {} quads are folded or have a flat corner, as the scan's relief there "
                        "is finer than a quad. More faces, or triangles, avoid that.",
                        names_[current_], q.bad_quads));
      }
    }
    report_.output.target_faces = job_.target.faces;
    report_.output.target_met = finisher_.met();
    if (!report_.output.target_met) {
      progress_.warning(
          fmt::format("{}: {:.0f} faces instead of {:.0f}: the nearest that the scan's "
                      "topology and relief allow.",
                      names_[current_], finisher_.faces(), job_.target.faces));
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
    metadata.input_hash = record_.input.sha256;
    metadata.origin = job_.mesh.origin;
    steps_.depend_on(metadata.options);
    steps_.next_makes(names_[current_]);
    const PromptReturn prompt(budget_.tight());
    const WriteResult written =
        steps_.run("write", [&] { return write_output(job_.remesh.get(), metadata); });
    report_.output.bytes = written.bytes;
    report_.output.vertices = written.vertices;
    report_.output.faces = written.faces;
    report_.output.origin = written.origin;
  }

  WriteResult write_output(PolygonMesh& remesh, const RemeshMetadata& metadata) const {
    const double unit = job_.mesh.unit;
    if (unit != 1.0) {
      for (Vec3d& p : remesh.positions) {
        p *= unit;
      }
    }
    WriteOptions options;
    options.position_bits = options_.position_bits;
    WriteResult written = write_remesh(remesh, metadata, names_[current_], options);
    if (unit != 1.0) {  // a picture comes yet
      for (Vec3d& p : remesh.positions) {
        p /= unit;
      }
    }
    return written;
  }

  void preview() {
    steps_.depend_on("");
    steps_.next_makes(previews_[current_]);
    steps_.run("preview", [&] {
      finisher_.release();
      const PromptReturn prompt(budget_.tight());
      const Reservation pixels =
          budget_.reserve(memory_need(memory_wish(0, 0.0), memory_).picture, "the preview");
      RenderOptions picture;
      picture.resident_triangles =
          std::min(picture.resident_triangles, budget_.available() / 4 / kPictureBytesPerTriangle);
      const Reservation kept = budget_.reserve(
          picture.resident_triangles * kPictureBytesPerTriangle, "the preview's surface");
      write_preview({.store = store_,
                     .scan = job_.mesh,
                     .remesh = &job_.remesh.get(),
                     .omega = maker_.omega(),
                     .density = maker_.density()},
                    previews_[current_], picture);
    });
  }

  void finish_size() {
    finisher_.release();
    report_.output.path = names_[current_];
    report_.distance = finisher_.distance();
    const SingularityCounts& s = maker_.singularities();
    report_.singularities = {s.vertices, s.edges,
                             s.field_triangles + s.phase_triangles + s.negative_triangles};
    report_.outputs[current_] = {report_.output, report_.singularities, report_.distance,
                                 owner_ == current_ ? std::string() : names_[*owner_]};
    if (events_ != nullptr) {
      events_->output_written(report_.outputs[current_]);
    }
    if (owner_ == current_) {
      const std::vector<SolveReport>& solves = job_.field.reports;
      record_.solver.insert(record_.solver.end(), solves.begin(), solves.end());
      record_.solver.push_back(maker_.phase_report());
    }
  }

  void finish_report() {
    finish_record();
    static_cast<RunRecord&>(report_) = std::move(record_);
    report_.options = options_;
    report_.output = report_.outputs[0].output;
    report_.singularities = report_.outputs[0].singularities;
    report_.distance = report_.outputs[0].distance;
    if (!options_.report.empty()) {
      write_report(report_, options_.report);
    }
  }

  // Corners of ragged creases for each face: more leave no room for quads beside them.
  static constexpr double kMostCorners = 0.1;

  RemeshReport report_;
  const RemeshOptions& options_;
  const std::vector<std::string> names_;     ///< one a size
  const std::vector<std::string> previews_;  ///< likewise
  JobContext job_;
  QuadMaker maker_;
  QuadFinisher finisher_;

  std::size_t current_ = 0;           ///< which size is being made
  std::optional<std::size_t> owner_;  ///< the size whose field and phases the store holds
  bool expected_to_meet_ = false;     ///< before the curves were divided
};

}  // namespace

RemeshReport remesh_scan(const RemeshOptions& options, ProgressSink& progress,
                         const StopRequests& stop, JobEvents* events) {
  const RemeshOptions resolved = options.resolved();
  const std::vector<std::string> outputs = output_names(resolved);
  for (const std::string& output : outputs) {
    check_folder(output);
  }
  return run_scan_job<RemeshJob, RemeshReport>(resolved, outputs[0], progress, stop, events);
}

}  // namespace rattan
