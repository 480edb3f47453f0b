// SPDX-License-Identifier: MIT
#include "tools/bench/kernels/workload.h"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <unistd.h>

#include "engine/mesh/ingest.h"
#include "engine/param/periodic_energy.h"
#include "io/scan/scan_reader.h"
#include "io/synth/synth.h"

namespace rattan {

namespace {

// As rattan-bench: 1.6 million triangles to 50,000 faces.
constexpr double kFacesPerTriangle = 0.03125;

std::uint64_t wanted_triangles = 200000;

}  // namespace

Workload::Workload(std::uint64_t triangles) {
  const std::string scan = (std::filesystem::temp_directory_path() /
                            ("rattan-kernels." + std::to_string(getpid()) + ".ply"))
                               .string();
  NullProgress quiet;
  SynthOptions synth;
  synth.triangles = triangles;
  synthesise(synth, scan, quiet);
  Ingest ingest(store, {});
  read_scan(scan, ingest);
  std::filesystem::remove(scan);
  mesh = ingest.finish(tasks);

  const double faces = kFacesPerTriangle * static_cast<double>(mesh.topology.triangles);
  quad_side = std::sqrt(mesh.area / faces);
  FieldOptions options;
  options.quad_side = quad_side;
  options.find_features = false;  // phases without pins: one kind of system
  field = compute_field(store, mesh, options, tasks);
  ParamOptions param;
  param.omega = quad_side;
  param.density = 1;
  parameterize(store, mesh, field, param, tasks);

  // Solves leave nothing but their solutions.
  SmoothingOptions smoothing;
  smoothing.fitting_length = options.fitting_length * quad_side;
  smoothing.floor_curvature = 1e-3 / mesh.mean_edge_length;
  assemble_smoothing(store, mesh, smoothing, tasks);
  assemble_curl(store, mesh, tasks);
  assemble_phase(store, mesh, param.omega, tasks);

  for (std::uint32_t t = 0; t < mesh.layout.tile_count(); ++t) {
    const TileMesh tile = load_tile(store, mesh, TileId(t));
    positions.insert(positions.end(), tile.positions.begin(),
                     tile.positions.begin() + tile.extent.owned);
  }
}

void set_workload_triangles(std::uint64_t triangles) {
  wanted_triangles = triangles;
}

Workload& workload() {
  static const std::unique_ptr<Workload> only = std::make_unique<Workload>(wanted_triangles);
  return *only;
}

}  // namespace rattan
