// SPDX-License-Identifier: MIT
#include <filesystem>
#include <memory>

#include <fmt/format.h>

#include "engine/core/errors.h"
#include "engine/remesh/quality.h"
#include "engine/remesh/topology.h"
#include "io/remesh/remesh_reader.h"
#include "io/store/hdf5_store.h"
#include "tools/rattan/commands.h"

namespace rattan {

namespace {

int describe_mesh(const std::string& path) {
  RemeshMetadata metadata;
  const PolygonMesh mesh = read_polygons(path, &metadata);
  const MeshTopology t = check_topology(mesh);
  const MeshQuality q = measure_quality(mesh);
  fmt::print("{}: {} bytes\n", path, std::filesystem::file_size(path));
  fmt::print("faces               {} ({} quads, {} triangles)\n", mesh.face_count(), q.quads,
             q.triangles);
  fmt::print("vertices            {} ({} irregular in the interior)\n", t.vertices,
             q.irregular_vertices);
  fmt::print("components          {}\nboundary loops      {}\nEuler characteristic {}\n",
             t.components, t.boundary_loops, t.euler());
  fmt::print("mean edge length    {:.6g}, varying by {:.1f} %\n", q.mean_edge_length,
             100.0 * q.edge_length_variation);
  fmt::print(
      "quads               {:.1f} %, scaled Jacobian {:.3f} on average and {:.3f} at least, "
      "corners {:.1f} degrees from right angles\n",
      100.0 * q.quad_share, q.mean_scaled_jacobian, q.min_scaled_jacobian, q.mean_corner_deviation);
  if (!metadata.version.empty()) {
    fmt::print("origin              {:.17g} {:.17g} {:.17g}\n", metadata.origin.x(),
               metadata.origin.y(), metadata.origin.z());
    fmt::print("made by             rattan {} with {}\nof a scan with hash {}\n", metadata.version,
               metadata.options, metadata.input_hash);
  }
  if (!t.clean()) {
    fmt::print(
        "not a simple manifold quad mesh: {} faces of other degrees, {} non-manifold edges, {} "
        "non-manifold vertices, {} unused vertices\n",
        t.bad_degree, t.non_manifold_edges, t.non_manifold_vertices, t.unreferenced);
  }
  return 0;
}

int describe_work(const std::string& path) {
  const Hdf5Store store({.directory = path, .keep = true, .read_only = true});
  for (const StoredStage& stage : store.list()) {
    fmt::print("{}: {} bytes\n", stage.name, stage.file_bytes);
    for (const StoredField& field : stage.fields) {
      fmt::print("  {:<28} {} chunks, {} bytes\n", field.name, field.chunks, field.bytes);
    }
  }
  return 0;
}

}  // namespace

void add_info_command(CLI::App& app, Action& action) {
  auto path = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("info", "Describe a mesh file or a kept work directory.");
  command->add_option("path", *path, ".drc, .obj, .ply or .off file, or a work directory")
      ->required();
  command->callback([path, &action] {
    action = [path] {
      return std::filesystem::is_directory(*path) ? describe_work(*path) : describe_mesh(*path);
    };
  });
}

}  // namespace rattan
