// SPDX-License-Identifier: MIT
#include "jobs/compare_job.h"

#include <algorithm>
#include <filesystem>
#include <limits>
#include <unistd.h>

#include <nlohmann/json.hpp>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include "engine/core/errors.h"
#include "engine/mesh/ingest.h"
#include "io/remesh/remesh_reader.h"
#include "io/scan/scan_reader.h"
#include "io/store/hdf5_store.h"
#include "jobs/memory_share.h"
#include "jobs/version.h"

namespace rattan {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// Any file with polygons, in full coordinates relative to `origin`.
struct LoadedMesh {
  PolygonMesh mesh;
  Vec3d origin = Vec3d::Zero();
};

/// Gathers a scan of a format that holds triangles only.
class MeshSink final : public ScanSink {
 public:
  explicit MeshSink(PolygonMesh& mesh) : mesh_(mesh) {}
  void add_vertices(std::span<const Vec3d> positions) override {
    mesh_.positions.insert(mesh_.positions.end(), positions.begin(), positions.end());
  }
  void add_triangles(std::span<const std::array<std::uint64_t, 3>> triangles) override {
    for (const auto& t : triangles) {
      mesh_.add_face(std::array{narrow(t[0]), narrow(t[1]), narrow(t[2])});
    }
  }

 private:
  static std::uint32_t narrow(std::uint64_t v) {
    return static_cast<std::uint32_t>(
        std::min<std::uint64_t>(v, std::numeric_limits<std::uint32_t>::max()));
  }
  PolygonMesh& mesh_;
};

std::string lower_extension(const std::string& path) {
  std::string extension = fs::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) {
    return static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  });
  return extension;
}

LoadedMesh load_polygons(const std::string& path) {
  const std::string extension = lower_extension(path);
  LoadedMesh loaded;
  if (extension == ".drc" || extension == ".obj" || extension == ".ply" || extension == ".off") {
    RemeshMetadata metadata;
    loaded.mesh = read_polygons(path, &metadata);
    loaded.origin = metadata.origin;
  } else {
    MeshSink sink(loaded.mesh);
    read_scan(path, sink);
  }
  for (std::size_t v = 0; v < loaded.mesh.vertex_count(); ++v) {
    if (!loaded.mesh.positions[v].allFinite()) {
      throw InputError(path, "vertex " + std::to_string(v), "a coordinate is not a finite number",
                       "Compare meshes whose coordinates are all finite");
    }
  }
  if (loaded.mesh.face_count() == 0) {
    throw InputError(path, "", "there is no face in the file", "Compare files that hold a surface");
  }
  return loaded;
}

/// A .drc as a scan: divided as the remesh is, so that equal files have no distance.
void read_draco_scan(const std::string& path, ScanSink& sink) {
  LoadedMesh loaded = load_polygons(path);
  for (Vec3d& p : loaded.mesh.positions) {
    p += loaded.origin;
  }
  sink.add_vertices(loaded.mesh.positions);
  std::vector<std::array<std::uint64_t, 3>> triangles;
  for (std::size_t f = 0; f < loaded.mesh.face_count(); ++f) {
    for_face_triangles(loaded.mesh, f, [&](const LocalTriangle& t) {
      triangles.push_back({t[0], t[1], t[2]});
    });
  }
  sink.add_triangles(triangles);
}

ScanMesh ingest_scan(const CompareOptions& options, std::uint64_t memory, Store& store,
                     TaskGraph& tasks) {
  IngestOptions how;
  how.memory_bytes = memory / 4;
  how.input_name = options.scan;
  Ingest ingest(store, how);
  if (lower_extension(options.scan) == ".drc") {
    read_draco_scan(options.scan, ingest);
  } else {
    read_scan(options.scan, ingest);
  }
  return ingest.finish(tasks);
}

std::string scratch_folder(const CompareOptions& options) {
  if (!options.work_dir.empty()) {
    return options.work_dir;
  }
  std::error_code ignored;
  const fs::path base = fs::temp_directory_path(ignored);
  return (base / ("rattan-compare." + std::to_string(getpid()))).string();
}

Json defects_json(const MeshTopology& t, const MeshQuality& q) {
  return {{"non_manifold_edges", t.non_manifold_edges},
          {"inconsistent_edges", t.inconsistent_edges},
          {"non_manifold_vertices", t.non_manifold_vertices},
          {"repeated_vertices", t.repeated_vertex},
          {"duplicate_faces", t.duplicate_faces},
          {"interior_valence_two", t.valence_two},
          {"inverted_quads", q.bad_quads},
          {"other_degrees", t.bad_degree},
          {"short_loops", t.short_loops},
          {"unused_vertices", t.unreferenced}};
}

Json distances_json(const OneWayDistances& d, double diagonal) {
  const double percent = diagonal > 0.0 ? 100.0 / diagonal : 0.0;
  return {{"mean", percent * d.mean}, {"rms", percent * d.rms}, {"p99", percent * d.p99},
          {"max", percent * d.max},   {"points", d.points},     {"samples", d.samples}};
}

}  // namespace

bool CompareReport::same_topology() const {
  return remesh.components == scan.components && remesh.boundary_loops == scan.boundary_loops &&
         remesh.euler() == scan.euler();
}

CompareReport compare_surfaces(const CompareOptions& options, ProgressSink& progress) {
  const int threads =
      options.threads > 0 ? options.threads : oneapi::tbb::this_task_arena::max_concurrency();
  const oneapi::tbb::global_control parallelism(
      oneapi::tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  const std::uint64_t memory = options.memory > 0 ? options.memory : default_memory_share();
  CompareReport report;
  report.options = options;

  LoadedMesh loaded = load_polygons(options.remesh);
  report.remesh = check_topology(loaded.mesh);
  if (report.remesh.out_of_range > 0) {
    throw InputError(options.remesh, "", "faces refer to vertices that the file does not hold",
                     "Export the mesh again");
  }
  report.quality = measure_quality(loaded.mesh);

  Hdf5Store store({.directory = scratch_folder(options), .cache_bytes = memory / 2});
  TaskGraph tasks({.threads = threads}, &progress);
  const ScanMesh scan = ingest_scan(options, memory, store, tasks);
  report.scan = scan.topology;
  report.repaired = scan.repaired;
  report.scan_area = scan.area;
  for (Vec3d& p : loaded.mesh.positions) {
    p += loaded.origin - scan.origin;
  }
  // About 50 bytes a triangle; a quarter of the memory holds these many tiles.
  const std::uint64_t tile_bytes =
      50 * std::max<std::uint64_t>(scan.topology.triangles / scan.layout.tile_count(), 1);
  const auto alive = static_cast<std::uint32_t>(
      std::clamp<std::uint64_t>(memory / 4 / tile_bytes, 1, scan.layout.tile_count()));
  SurfaceProjector projector(store, scan, {.tiles_alive = alive}, tasks);
  report.distance = measure_distances(loaded.mesh, store, scan, projector,
                                      {.scan_stride = 1, .samples = options.samples}, tasks);
  return report;
}

nlohmann::ordered_json to_json(const CompareReport& r) {
  const MeshTopology& t = r.remesh;
  const MeshQuality& q = r.quality;
  Json j;
  j["rattan"] = {{"version", version()}, {"commit", commit()}};
  j["remesh"] = {
      {"path", r.options.remesh},
      {"vertices", t.vertices},
      {"edges", t.edges},
      {"faces", t.faces},
      {"quads", q.quads},
      {"triangles", q.triangles},
      {"quad_share", q.quad_share},
      {"interior_vertices", q.interior_vertices},
      {"irregular_vertices", q.irregular_vertices},
      {"irregular_share", q.interior_vertices > 0 ? static_cast<double>(q.irregular_vertices) /
                                                        static_cast<double>(q.interior_vertices)
                                                  : 0.0},
      {"mean_scaled_jacobian", q.mean_scaled_jacobian},
      {"min_scaled_jacobian", q.min_scaled_jacobian},
      {"mean_corner_deviation", q.mean_corner_deviation},
      {"mean_edge_length", q.mean_edge_length},
      {"edge_length_variation", q.edge_length_variation},
      {"components", t.components},
      {"boundary_loops", t.boundary_loops},
      {"euler", t.euler()},
      {"defects", defects_json(t, q)}};
  j["scan"] = {{"path", r.options.scan},
               {"vertices", r.scan.vertices},
               {"triangles", r.scan.triangles},
               {"components", r.scan.components},
               {"boundary_loops", r.scan.boundary_loops},
               {"euler", r.scan.euler()},
               {"diagonal", r.distance.diagonal},
               {"area", r.scan_area}};
  j["same_topology"] = r.same_topology();
  j["distance"] = {{"remesh_to_scan", distances_json(r.distance.to_input, r.distance.diagonal)},
                   {"scan_to_remesh", distances_json(r.distance.from_input, r.distance.diagonal)}};
  return j;
}

}  // namespace rattan
