// SPDX-License-Identifier: MIT
#pragma once

// The report of one run. Names are a contract: see the README's table.

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "engine/core/types.h"
#include "engine/mesh/tile_mesh.h"
#include "engine/remesh/distance.h"
#include "engine/solve/solver.h"
#include "jobs/remesh_options.h"

namespace rattan {

struct StageRecord {
  std::string name;
  double seconds = 0.0;
  double cpu_seconds = 0.0;
  std::uint64_t passes = 0;      ///< over the tiles of the finest level
  std::uint64_t bytes_read = 0;  ///< from disk
  std::uint64_t bytes_written = 0;
  std::uint64_t bytes_moved = 0;  ///< of fields, to and from the tiles at work, cached ones too
  bool resumed = false;
};

/// What is known of any run on one scan.
struct RunRecord {
  struct {
    std::string path;
    std::string sha256;
    ScanTopology topology;
    RepairCounts repaired;
  } input;
  std::vector<StageRecord> stages;
  std::vector<SolveReport> solver;
  std::vector<std::string> warnings;
  std::uint64_t work_bytes = 0;  ///< on disk in the work directory, at most
  std::uint64_t peak_rss_bytes = 0;
  std::uint64_t memory_budget_bytes = 0;
  int threads = 0;
  double seconds = 0.0;
};

struct RemeshReport : RunRecord {
  RemeshOptions options;
  struct {
    std::string path;
    std::uint64_t bytes = 0;
    Vec3d origin = Vec3d::Zero();
    bool target_met = false;
    double target_faces = 0.0;
    std::uint64_t vertices = 0;
    std::uint64_t faces = 0;
    std::uint64_t quads = 0;
    std::uint64_t triangles = 0;
    std::uint64_t interior_vertices = 0;
    std::uint64_t irregular_vertices = 0;  ///< interior, valence other than 4
    std::uint64_t bad_quads = 0;  ///< scaled Jacobian <= 0; without pure_quads there is none
    std::uint64_t components = 0;
    std::uint64_t boundary_loops = 0;
    std::int64_t euler = 0;
    double mean_scaled_jacobian = 0.0;
    double min_scaled_jacobian = 0.0;
    double mean_corner_deviation = 0.0;  ///< degrees
    double edge_length_variation = 0.0;  ///< standard deviation / mean
    double stretch = 0.0;                ///< see MeshQuality
    double shear = 0.0;
  } output;
  struct {
    std::uint64_t vertices = 0;
    std::uint64_t edges = 0;
    std::uint64_t triangles = 0;
  } singularities;
  DistanceReport distance;
  /// One a size, as asked for; `output`, `singularities` and `distance` are those of the first.
  struct Finished {
    decltype(RemeshReport::output) output;
    decltype(RemeshReport::singularities) singularities;
    decltype(RemeshReport::distance) distance;
    /// The output whose parameterization this one was made from; empty if it has its own.
    std::string shared_with;
  };
  std::vector<Finished> outputs;
};

/// Options that all jobs on one scan share, into the report's `options`.
void add_scan_options(nlohmann::ordered_json& options, const ScanOptions& o);
/// What begins the report of any run: rattan, input; and what ends it: stages, solver and the rest.
nlohmann::ordered_json run_head(const RunRecord& record);
void add_run(nlohmann::ordered_json& report, const RunRecord& record);
/// Throws ResourceError when the file cannot be written.
void write_json_report(const nlohmann::ordered_json& report, const std::string& path);

nlohmann::ordered_json to_json(const RemeshReport& report);
/// Throws ResourceError when the file cannot be written.
void write_report(const RemeshReport& report, const std::string& path);

}  // namespace rattan
