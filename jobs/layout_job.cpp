// SPDX-License-Identifier: MIT
#include "jobs/layout_job.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include <fmt/format.h>

#include "engine/core/packed_chunk.h"
#include "engine/core/resident_memory.h"
#include "engine/layout/atlas.h"
#include "engine/layout/base_complex.h"
#include "engine/layout/chart_extraction.h"
#include "engine/layout/flat_layout.h"
#include "engine/layout/transitions.h"
#include "engine/param/distortion.h"
#include "engine/param/parameterize.h"
#include "engine/remesh/topology.h"
#include "io/layout/bake.h"
#include "io/layout/layout_writer.h"
#include "io/layout/material.h"
#include "io/layout/texture_picture.h"
#include "io/layout/textured_scan.h"
#include "io/layout/transition_writer.h"
#include "io/remesh/remesh_writer.h"
#include "jobs/job_context.h"
#include "jobs/memory_plan.h"
#include "jobs/preview.h"
#include "jobs/remesh_cost.h"
#include "jobs/scan_job.h"
#include "jobs/version.h"
#include "jobs/work_record.h"

namespace rattan {

namespace {

/// Of a chart, in mean edges of the scan, unless asked for (PGP 2.2).
constexpr double kEdgesPerChart = 10.0;
/// Mean of the curl correction's scales: corrected charts are larger where they can be.
constexpr double kCurlMean = 1.25;
/// Charts that are no disks make all charts smaller by this, so many times at most.
constexpr double kSmaller = 0.7071067811865476;
constexpr int kMostSmaller = 4;
constexpr std::uint64_t kKeptBytesPerChart = 1000;

/// What one try at a chart size found.
struct Tried {
  bool found = false;
  std::uint64_t not_disks = 0;
  std::uint64_t crowded = 0;
  std::uint64_t missing = 0;  ///< cuts needed and sides too many
  SingularityCounts singularities;
};

template <class A>
void members_of(A& a, Tried& t) {
  a(t.found);
  a(t.not_disks);
  a(t.crowded);
  a(t.missing);
  a(t.singularities);
}

struct Flattened {
  FlatCounts counts;
  DistortionFigures solved;
  DistortionFigures written;
};

DistortionFigures figures(const DistortionSums& sums) {
  return {sums.stretch_trimmed(), sums.stretch(), sums.shear()};
}

class LayoutJob : public ScanJob {
 public:
  LayoutJob(const LayoutOptions& options, const JobPlace& place, const JobAttempt& attempt)
      : ScanJob(options, place, attempt), options_(options), names_(layout_names(options.output)) {}

  LayoutReport run() {
    check_memory(wish(0, 0.0), memory_, options_.scan);
    process_memory_ = budget_.reserve(memory_need({.threads = threads_}, memory_).total(),
                                      "the program and tiles at work");
    store_.set_note(kOptionsNote, options_.canonical());
    clock_.run("ingest", [&] { mesh_ = ingest(); });
    // A scan may be a single point.
    edge_ = mesh_.mean_edge_length > 0.0 ? mesh_.mean_edge_length : 1.0;
    report_.asked_side =
        options_.chart_size > 0.0 ? options_.chart_size / mesh_.unit : kEdgesPerChart * edge_;
    check_sizes();
    clock_.run("field", [&] { compute_fields(); });
    find_charts();
    clock_.run("flatten", [&] { flatten(); });
    clock_.run("write", [&] { write(); });
    if (options_.bake > 0) {
      clock_.run("bake", [&] { bake_image(); });
    }
    if (!options_.preview.empty()) {
      clock_.run("preview", [&] { preview(); });
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
  MemoryWish wish(std::uint64_t vertices, double charts) const {
    return {.vertices = vertices,
            .threads = threads_,
            .picture = !options_.preview.empty(),
            .charts = charts};
  }

  /// What is known to be too large, before it is computed.
  void check_sizes() {
    const double charts = mesh_.area / (report_.asked_side * report_.asked_side);
    check_memory(wish(mesh_.topology.vertices, charts), memory_, options_.scan);
    scan_memory_ = budget_.reserve(memory_need(wish(mesh_.topology.vertices, 0.0), memory_).scan,
                                   "the scan's tables");
    const std::uint64_t triangles = kLayoutTriangles * mesh_.topology.triangles;
    const std::uint64_t writer = layout_write_bytes(options_.output, triangles);
    if (writer > budget_.available()) {
      throw ResourceError(fmt::format(
          "{}: encoding some {} triangles takes {} of memory, and {} are left of the budget. Allow "
          "--memory {}MiB, or write an .obj or .ply, which need next to none.",
          options_.output, triangles, format_bytes(writer), format_bytes(budget_.available()),
          budget_for(writer)));
    }
    if (options_.bake > 0) {
      texture_ = outline_textures(options_.scan);
      check_layout_files(options_, texture_->files);
      bakes_textures(options_.scan, *texture_, mesh_.has_colours);
      const std::uint64_t bytes = texture_->bytes + bake_bytes(options_.bake);
      if (bytes > budget_.available()) {
        throw ResourceError(fmt::format(
            "{}: baking takes {} of memory, and {} are left of the budget. Allow --memory "
            "{}MiB, or ask for a smaller image.",
            names_.image, format_bytes(bytes), format_bytes(budget_.available()),
            budget_for(bytes)));
      }
    }
  }

  /// MiB with which so many bytes would be available; more memory lets a few more tiles be at work.
  std::uint64_t budget_for(std::uint64_t bytes) const {
    constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;
    const std::uint64_t total = memory_ - budget_.available() + bytes;
    const std::uint64_t tiles = memory_need({.threads = threads_}, total).tiles -
                                memory_need({.threads = threads_}, memory_).tiles;
    return (total + tiles) / kMiB + 1;
  }

  void compute_fields() {
    FieldOptions options;
    // Smoothing belongs to the scan, not to the charts.
    options.quad_side = kEdgesPerChart * edge_;
    options.low_pass = 0.3;
    options.curvature_reach = 0.2;
    options.fitting_length = 1.0;
    options.energy = options_.energy == Energy::kEdge ? EdgeEnergy::kEdge : EdgeEnergy::kTriangle;
    options.symmetry = static_cast<Symmetry>(options_.symmetry);
    options.smoothing = options_.smoothing;
    options.pin_features = false;
    options.pin_boundary = true;
    options.features.tolerance = kCurveTolerance * mesh_.diagonal();
    options.curl_power = options_.curl_correction ? 1.0 : 0.0;
    if (options_.curl_correction) {
      options.curl_mean = kCurlMean;
    }
    steps_.depend_on(fmt::format("energy={} symmetry={} smoothing={:a} curl={:a}",
                                 static_cast<int>(options.energy), options_.symmetry,
                                 options.smoothing.value_or(-1.0), options.curl_power));
    field_ = compute_field(store_, mesh_, options, tasks_);
  }

  /// Charts of the size asked for, or as much smaller as it takes for all to be disks with no more
  /// sides than can be parameterized well. Where none of the sizes does, because the scan has holes
  /// or handles that are smaller still, the charts around these are cut, at the largest size that
  /// lacks about as little as any.
  void find_charts() {
    std::vector<double> sides;
    std::vector<std::uint64_t> bad;
    double side = report_.asked_side;
    for (int i = 0; i <= kMostSmaller; ++i, side *= kSmaller) {
      if (try_side(side, false)) {
        break;
      }
      sides.push_back(side);
      bad.push_back(tried_.missing);
    }
    if (!tried_.found) {
      const std::uint64_t least = *std::min_element(bad.begin(), bad.end());
      std::size_t best = 0;
      while (2 * bad[best] > 3 * least) {
        ++best;
      }
      try_side(sides[best], true);
    }
    charts_.emplace();
    read_packed(store_, kCharts, *charts_);
    // The graph, then what is known of each flat chart, the base complex, transition functions.
    layout_memory_ =
        budget_.reserve(kKeptBytesPerChart * charts_->graph.chart_count(), "the graph of charts");
    report_.side = omega_;
    report_.not_disks = tried_.not_disks;
    report_.crowded = tried_.crowded;
    report_.singularities = tried_.singularities;
    say_size();
  }

  void say_size() {
    if (report_.side < report_.asked_side) {
      progress_.warning(fmt::format(
          "{}: charts of side {:.6g} are not all disks of a few sides; they have a side of "
          "{:.6g}.",
          options_.output, report_.asked_side * mesh_.unit, report_.side * mesh_.unit));
    }
    if (report_.not_disks > 0) {
      progress_.warning(
          fmt::format("{}: {} charts around holes, handles or parts smaller than a chart were cut.",
                      options_.output, report_.not_disks));
    }
    if (report_.crowded > 0) {
      progress_.warning(
          fmt::format("{}: {} charts have more than {} sides. Smaller charts, with "
                      "--chart-size, follow the scan's features better.",
                      options_.output, report_.crowded, kManyChartSides));
    }
  }

  bool try_side(double side, bool cut) {
    omega_ = side;
    check_memory(wish(mesh_.topology.vertices, mesh_.area / (side * side)), memory_, options_.scan);
    clock_.run("parameterize", [&] {
      ParamOptions options;
      options.omega = omega_;
      options.density = 1;
      options.solve.newton_steps = options_.newton_steps;
      options.keep_norms = options_.keep_work;
      options.reference = options_.solver == SolverKind::kReference;
      steps_.depend_on(fmt::format("omega={:a} newton-steps={} reference={}", omega_,
                                   options.solve.newton_steps, options.reference));
      phase_report_ = parameterize(store_, mesh_, field_, options, tasks_);
    });
    clock_.run("charts", [&] {
      steps_.depend_on(fmt::format("omega={:a} cut={}", omega_, cut));
      steps_.before_long_step();
      tried_ = steps_.run("charts", [&] {
        const PromptReturn prompt(budget_.tight());
        const ArrangementOptions options{.omega = omega_, .density = 1, .budget = &budget_};
        ChartExtraction found;
        const std::optional<ChartLayout> layout =
            extract_charts(store_, mesh_, options, cut, tasks_, found);
        if (layout) {
          write_packed(store_, kCharts, *layout);
          save_lines(store_, omega_, 1);
        }
        return Tried{layout.has_value(), found.not_disks, found.still_crowded,
                     found.cuts + found.excess, found.lines.singularities};
      });
    });
    return tried_.found;
  }

  void flatten() {
    steps_.depend_on(fmt::format("relax={}", options_.relax));
    steps_.before_long_step();
    const auto [counts, solved, written] = steps_.run("flatten", [&] {
      const DistortionSums before = measure_distortion(store_, mesh_, omega_, tasks_);
      DistortionSums after;
      flat_ = flatten_layout(store_, mesh_, *charts_, omega_, options_.relax, tasks_, after);
      write_packed(store_, kFlatLayout, *flat_);
      erase_pieces(store_);
      return Flattened{flat_->counts, figures(before), figures(after)};
    });
    if (!flat_) {
      flat_.emplace();
      read_packed(store_, kFlatLayout, *flat_);
    }
    report_.charts = counts;
    report_.distortion = solved;
    report_.repaired = written;
  }

  RemeshMetadata metadata() const {
    RemeshMetadata m;
    m.version = version();
    m.options = options_.canonical();
    if (!field_hash_.empty()) {
      m.options += " field=" + field_hash_;
    }
    m.input_hash = record_.input.sha256;
    m.origin = mesh_.origin;
    return m;
  }

  void write() {
    StoredLayout stored(store_, mesh_, *charts_, *flat_, tasks_);
    const RemeshMetadata meta = metadata();
    steps_.depend_on(meta.options);
    const PromptReturn prompt(budget_.tight());
    plan_atlas(stored);
    steps_.next_makes(options_.output);
    const LayoutWriteResult written = steps_.run("write", [&] {
      LayoutWriteOptions options;
      options.unit = mesh_.unit;
      options.position_bits = options_.position_bits;
      if (options_.bake > 0 && is_obj()) {
        options.material_file = std::filesystem::path(names_.material).filename().string();
        options.material = kMaterial;
      } else if (options_.bake > 0) {
        options.image_file = std::filesystem::path(names_.image).filename().string();
      }
      if (plan_) {
        options.texture_bits = static_cast<int>(plan_->bits(options.texture_bits));
        AtlasSource atlas(stored, *plan_);
        return write_layout(atlas, meta, options_.output, options);
      }
      return write_layout(stored, meta, options_.output, options);
    });
    if (written.folded > 0) {
      throw InputError(options_.output, "",
                       fmt::format("{} triangles of charts with many sides are too thin for "
                                   "texture coordinates in single precision",
                                   written.folded),
                       "Write an .obj, or make charts smaller with --chart-size");
    }
    report_.output.bytes = written.bytes;
    report_.output.origin = written.origin;
    report_.output.texture_step = written.texture_step;

    steps_.next_makes(names_.charts);
    steps_.run("transitions", [&] {
      std::vector<ChartKind> kinds;
      for (const std::uint8_t k : flat_->chart_kind) {
        kinds.push_back(static_cast<ChartKind>(k));
      }
      return write_transitions(transitions_of(charts_->graph), kinds, meta, names_.charts);
    });
    write_base(meta);
  }

  bool is_obj() const { return std::filesystem::path(options_.output).extension() == ".obj"; }

  void write_base(const RemeshMetadata& meta) {
    PolygonMesh base = base_complex(*charts_, *flat_);
    const MeshTopology t = check_topology(base);
    const ScanTopology& scan = mesh_.topology;
    ensure(t.simple() && t.components == scan.components &&
               t.boundary_loops == scan.boundary_loops && t.euler() == scan.euler(),
           "the base complex is a simple mesh with the scan's topology");
    report_.base.quads = base.face_count();
    report_.base.components = t.components;
    report_.base.boundary_loops = t.boundary_loops;
    report_.base.euler = t.euler();
    for (Vec3d& p : base.positions) {
      p *= mesh_.unit;
    }
    steps_.next_makes(names_.base);
    const WriteResult written = steps_.run("base complex", [&] {
      WriteOptions options;
      options.position_bits = options_.position_bits;
      return write_remesh(base, meta, names_.base, options);
    });
    report_.base.path = names_.base;
    report_.base.bytes = written.bytes;
    report_.base.vertices = written.vertices;
  }

  void plan_atlas(LayoutSource& stored) {
    if (!options_.atlas && options_.bake == 0) {
      return;
    }
    std::vector<std::uint32_t> split;
    for (std::uint32_t c = 0; c < flat_->size.charts; ++c) {
      const bool whole = static_cast<ChartKind>(flat_->chart_kind[c]) != ChartKind::kSplit;
      split.push_back(whole ? 0 : flat_->part_begin[c + 1] - flat_->part_begin[c]);
    }
    plan_.emplace(stored.size(), split, AtlasOptions{.image_size = options_.bake});
    report_.output.atlas_used = plan_->efficiency();
  }

  void bake_image() {
    steps_.depend_on(metadata().options);
    steps_.next_makes(names_.image);
    steps_.run("bake", [&] {
      StoredLayout stored(store_, mesh_, *charts_, *flat_, tasks_);
      AtlasSource atlas(stored, *plan_);
      const Reservation memory = budget_.reserve(texture_->bytes + bake_bytes(options_.bake),
                                                 "the image and the scan's textures");
      std::optional<TexturedScan> textured;
      if (bakes_textures(options_.scan, *texture_, mesh_.has_colours)) {
        textured.emplace(options_.scan, *texture_, mesh_.origin, mesh_.unit);
      }
      const BakedImage baked = bake(atlas, *plan_, textured ? &*textured : nullptr);
      write_png_rows(baked.image, names_.image);
    });
    report_.output.image = names_.image;
    if (is_obj()) {
      steps_.next_makes(names_.material);
      steps_.run("material", [&] {
        write_material(names_.material, kMaterial,
                       std::filesystem::path(names_.image).filename().string());
      });
      report_.output.material = names_.material;
    }
  }

  void preview() {
    steps_.depend_on("");
    steps_.next_makes(options_.preview);
    steps_.run("preview", [&] {
      const PromptReturn prompt(budget_.tight());
      const Reservation pixels =
          budget_.reserve(memory_need(wish(0, 0.0), memory_).picture, "the preview");
      RenderOptions picture;
      picture.resident_triangles =
          std::min(picture.resident_triangles, budget_.available() / 4 / kPictureBytesPerTriangle);
      const Reservation kept = budget_.reserve(
          picture.resident_triangles * kPictureBytesPerTriangle, "the preview's surface");
      write_preview({.store = store_,
                     .scan = mesh_,
                     .charts = &*charts_,
                     .flat = &*flat_,
                     .omega = omega_,
                     .density = 1},
                    options_.preview, picture);
    });
  }

  void finish_report() {
    record_.solver = field_.reports;
    record_.solver.push_back(phase_report_);
    finish_record();
    static_cast<RunRecord&>(report_) = std::move(record_);
    report_.options = options_;
    report_.output.path = options_.output;
    report_.output.charts = names_.charts;
    report_.output.vertices = flat_->size.vertices;
    report_.output.texture_vertices = flat_->size.texture_vertices;
    report_.output.triangles = flat_->size.triangles;
    report_.parts = flat_->size.parts;
    report_.units = flat_->size.units;
    report_.asked_side *= mesh_.unit;
    report_.side *= mesh_.unit;
    for (const DistortionTotals& d : flat_->distortion) {
      report_.worst_chart_stretch = std::max(report_.worst_chart_stretch, d.stretch());
      report_.worst_chart_shear = std::max(report_.worst_chart_shear, d.shear());
    }
    if (!options_.report.empty()) {
      write_report(report_, options_.report);
    }
    if (events_ != nullptr) {
      events_->layout_written(report_);
    }
  }

  static constexpr const char* kMaterial = "atlas";

  const LayoutOptions& options_;
  const LayoutNames names_;
  LayoutReport report_;
  ScanMesh mesh_;
  SurfaceField field_;
  SolveReport phase_report_;
  double edge_ = 1.0;  ///< mean length
  double omega_ = 0.0;
  Tried tried_;
  Reservation layout_memory_;
  std::optional<ChartLayout> charts_;
  std::optional<FlatLayout> flat_;
  std::optional<AtlasPlan> plan_;
  std::optional<TextureOutline> texture_;
};

}  // namespace

LayoutReport layout_scan(const LayoutOptions& options, ProgressSink& progress,
                         const StopRequests& stop, JobEvents* events) {
  LayoutWriteOptions write;
  write.position_bits = options.position_bits;
  check_layout_output(options.output, write);
  check_folder(options.output);
  check_layout_files(options, std::vector{options.scan});
  return run_scan_job<LayoutJob, LayoutReport>(options, options.output, progress, stop, events);
}

}  // namespace rattan
