// SPDX-License-Identifier: MIT
#include "io/remesh/remesh_reader.h"

#include <cctype>
#include <filesystem>

#include "engine/core/errors.h"
#include "io/file/atomic_file.h"
#include "io/remesh/draco_polygons.h"
#include "io/remesh/polygon_files.h"
#include "io/remesh/remesh_format.h"

namespace rattan {

RemeshFormat remesh_format(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  for (char& c : extension) {
    c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  if (extension == ".drc") {
    return RemeshFormat::kDraco;
  }
  if (extension == ".obj") {
    return RemeshFormat::kObj;
  }
  if (extension == ".ply") {
    return RemeshFormat::kPly;
  }
  if (extension == ".off") {
    return RemeshFormat::kOff;
  }
  throw UsageError(path + ": a remesh is a .drc, .obj, .ply or .off file; '" + extension +
                   "' is none of them.");
}

PolygonMesh read_polygons(const std::string& path, RemeshMetadata* metadata) {
  const RemeshFormat format = remesh_format(path);
  const std::string bytes = read_file(path);
  if (metadata != nullptr) {
    *metadata = {};
  }
  switch (format) {
    case RemeshFormat::kDraco:
      return decode_draco(bytes, path, metadata);
    case RemeshFormat::kObj:
      return parse_obj(bytes, path);
    case RemeshFormat::kPly:
      return parse_ply(bytes, path);
    case RemeshFormat::kOff:
      break;
  }
  return parse_off(bytes, path);
}

PolygonMesh read_polygons_full(const std::string& path) {
  RemeshMetadata metadata;
  PolygonMesh mesh = read_polygons(path, &metadata);
  if (!metadata.origin.isZero(0.0)) {
    for (Vec3d& p : mesh.positions) {
      p += metadata.origin;
    }
  }
  return mesh;
}

}  // namespace rattan
