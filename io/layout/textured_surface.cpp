// SPDX-License-Identifier: MIT
#include "io/layout/textured_surface.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>

#include <Eigen/Geometry>
#include <draco/mesh/mesh.h>

#include "engine/core/errors.h"
#include "engine/layout/disjoint_sets.h"
#include "io/file/atomic_file.h"
#include "io/file/guarded_draco.h"
#include "io/layout/textured_faces.h"

namespace rattan {
namespace {

constexpr float kNoCoordinate = std::numeric_limits<float>::quiet_NaN();
constexpr std::uint64_t kMostMemory = std::uint64_t{16} << 30;

class SurfaceSink final : public TexturedFaceSink {
 public:
  void add_vertex(const Vec3d& position) override { positions_.push_back(position); }
  void add_texture_vertex(double u, double v) override {
    uv_.push_back({static_cast<float>(u), static_cast<float>(v)});
  }
  void add_triangle(const std::array<std::uint64_t, 3>& vertex,
                    const std::array<std::uint64_t, 3>& texture, std::uint32_t) override {
    vertex_.push_back(vertex);
    texture_.push_back(texture);
  }

  TexturedSurface take(const std::string& path) {
    TexturedSurface out;
    out.corner_uv.reserve(3 * vertex_.size());
    for (std::size_t t = 0; t < vertex_.size(); ++t) {
      std::array<std::uint32_t, 3> corners{};
      bool textured = true;
      for (std::size_t k = 0; k < 3; ++k) {
        if (vertex_[t][k] >= positions_.size() ||
            (texture_[t][k] != kNoTexture && texture_[t][k] >= uv_.size())) {
          throw InputError(path, "triangle " + std::to_string(t),
                           "it refers to a vertex that the file does not hold",
                           "Export the mesh again");
        }
        corners[k] = static_cast<std::uint32_t>(vertex_[t][k]);
        textured = textured && texture_[t][k] != kNoTexture;
      }
      out.mesh.add_face(corners);
      for (std::size_t k = 0; k < 3; ++k) {
        out.corner_uv.push_back(textured ? uv_[texture_[t][k]]
                                         : std::array{kNoCoordinate, kNoCoordinate});
      }
    }
    out.mesh.positions = std::move(positions_);
    return out;
  }

 private:
  std::vector<Vec3d> positions_;
  std::vector<std::array<float, 2>> uv_;
  std::vector<std::array<std::uint64_t, 3>> vertex_;
  std::vector<std::array<std::uint64_t, 3>> texture_;
};

TexturedSurface read_draco(const std::string& path) {
  TexturedSurface out;
  const std::string bytes = read_file(path);
  const std::unique_ptr<draco::Mesh> mesh = decode_draco_mesh(bytes, path, kMostMemory);
  const auto* position = mesh->GetNamedAttribute(draco::GeometryAttribute::POSITION);
  const auto* texture = mesh->GetNamedAttribute(draco::GeometryAttribute::TEX_COORD);
  const auto usable = [](const draco::PointAttribute* a, int components) {
    return a != nullptr && a->num_components() == components && a->size() > 0 && holds_numbers(*a);
  };
  if (!usable(position, 3) || !usable(texture, 2)) {
    return out;
  }
  out.mesh.positions.resize(position->size());
  for (std::uint32_t v = 0; v < position->size(); ++v) {
    std::array<double, 3> p{};
    position->ConvertValue<double, 3>(draco::AttributeValueIndex(v), p.data());
    out.mesh.positions[v] = Vec3d(p[0], p[1], p[2]);
  }
  for (draco::FaceIndex f(0); f < mesh->num_faces(); ++f) {
    std::array<std::uint32_t, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      const draco::PointIndex point = mesh->face(f)[k];
      const bool there = point.value() < mesh->num_points();
      corners[k] = there ? position->mapped_index(point).value() : position->size();
      std::array<float, 2> uv{};
      if (corners[k] >= position->size() ||
          texture->mapped_index(point).value() >= texture->size() ||
          !texture->ConvertValue<float, 2>(texture->mapped_index(point), uv.data())) {
        throw InputError(path, "triangle " + std::to_string(f.value()),
                         "it refers to a point that the file does not hold",
                         "Encode the mesh again");
      }
      out.corner_uv.push_back(uv);
    }
    out.mesh.add_face(corners);
  }
  return out;
}

void check(const TexturedSurface& surface, const std::string& path) {
  const bool textured =
      std::any_of(surface.corner_uv.begin(), surface.corner_uv.end(),
                  [](const auto& uv) { return std::isfinite(uv[0]) && std::isfinite(uv[1]); });
  if (!textured) {
    throw InputError(path, "", "it holds no texture coordinates, which a texture needs",
                     "Give an .obj, .ply or .drc with texture coordinates, such as rattan layout "
                     "writes");
  }
  for (std::size_t v = 0; v < surface.mesh.vertex_count(); ++v) {
    if (!surface.mesh.positions[v].allFinite()) {
      throw InputError(path, "vertex " + std::to_string(v), "a coordinate is not a finite number",
                       "Use a mesh whose coordinates are all finite");
    }
  }
}

struct Side {
  std::uint64_t key;
  std::uint32_t corner;
};

}  // namespace

TexturedSurface read_textured_surface(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) {
    return static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  });
  TexturedSurface out;
  if (extension == ".drc") {
    out = read_draco(path);
  } else {
    SurfaceSink sink;
    read_textured_faces(path, sink, false);
    out = sink.take(path);
  }
  check(out, path);
  return out;
}

TexturePieces texture_pieces(const TexturedSurface& surface, const Vec3d& shift) {
  const PolygonMesh& mesh = surface.mesh;
  const auto triangles = static_cast<std::uint32_t>(mesh.face_count());
  const auto& uv = surface.corner_uv;
  const auto next = [](std::uint32_t c) { return c % 3 == 2 ? c - 2 : c + 1; };
  TexturePieces out;
  const auto textured = [&](std::uint32_t t) {
    return std::all_of(&uv[3 * std::size_t{t}], &uv[3 * std::size_t{t}] + 3,
                       [](const auto& x) { return std::isfinite(x[0]) && std::isfinite(x[1]); });
  };
  std::vector<Side> sides;
  sides.reserve(3 * std::size_t{triangles});
  for (std::uint32_t c = 0; c < 3 * triangles; ++c) {
    const std::uint64_t a = mesh.corners[c];
    const std::uint64_t b = mesh.corners[next(c)];
    sides.push_back({std::min(a, b) << 32 | std::max(a, b), c});
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return a.key != b.key ? a.key < b.key : a.corner < b.corner;
  });
  layout::DisjointSets pieces(triangles);
  for (std::size_t i = 0; i + 1 < sides.size(); ++i) {
    if (sides[i].key != sides[i + 1].key) {
      continue;
    }
    const std::uint32_t c = sides[i].corner;
    const std::uint32_t d = sides[i + 1].corner;
    const bool against = mesh.corners[c] != mesh.corners[d];
    if (uv[c] == uv[against ? next(d) : d] && uv[next(c)] == uv[against ? d : next(d)]) {
      pieces.unite(c / 3, d / 3);
    } else if (textured(c / 3) || textured(d / 3)) {
      out.seams.push_back({(mesh.positions[mesh.corners[c]] + shift).cast<float>(),
                           (mesh.positions[mesh.corners[next(c)]] + shift).cast<float>(),
                           LineKind::kChartBorder});
    }
  }
  for (std::uint32_t t = 0; t < triangles; ++t) {
    if (!textured(t)) {
      continue;
    }
    const auto& [a, b, c] =
        std::array{3 * std::size_t{t}, 3 * std::size_t{t} + 1, 3 * std::size_t{t} + 2};
    out.count += pieces.find(t) == t ? 1 : 0;
    const Vec3d p = mesh.positions[mesh.corners[a]];
    out.area +=
        0.5 *
        (mesh.positions[mesh.corners[b]] - p).cross(mesh.positions[mesh.corners[c]] - p).norm();
    out.uv_area += 0.5 * std::abs((double{uv[b][0]} - uv[a][0]) * (double{uv[c][1]} - uv[a][1]) -
                                  (double{uv[c][0]} - uv[a][0]) * (double{uv[b][1]} - uv[a][1]));
  }
  return out;
}

}  // namespace rattan
