// SPDX-License-Identifier: MIT
#include "jobs/load_mesh.h"

#include <algorithm>
#include <filesystem>
#include <limits>

#include "engine/core/errors.h"
#include "io/remesh/remesh_reader.h"
#include "io/scan/scan_reader.h"

namespace rattan {

namespace {

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
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) {
    return static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  });
  return extension;
}

}  // namespace

bool is_draco(const std::string& path) {
  return lower_extension(path) == ".drc";
}

LoadedMesh load_mesh(const std::string& path) {
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
  const PolygonMesh& mesh = loaded.mesh;
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
    if (!mesh.positions[v].allFinite()) {
      throw InputError(path, "vertex " + std::to_string(v), "a coordinate is not a finite number",
                       "Use a mesh whose coordinates are all finite");
    }
  }
  if (mesh.face_count() == 0) {
    throw InputError(path, "", "there is no face in the file", "Use a file that holds a surface");
  }
  if (std::any_of(mesh.corners.begin(), mesh.corners.end(),
                  [&](std::uint32_t v) { return v >= mesh.vertex_count(); })) {
    throw InputError(path, "", "faces refer to vertices that the file does not hold",
                     "Export the mesh again");
  }
  return loaded;
}

}  // namespace rattan
