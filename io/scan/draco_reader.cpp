// SPDX-License-Identifier: MIT
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include <draco/mesh/mesh.h>

#include "engine/core/errors.h"
#include "io/file/guarded_draco.h"
#include "io/scan/scan_parsers.h"

namespace rattan {
namespace {

constexpr const char* kRepair = "Export the scan again";
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

std::vector<char> read_whole(ByteSource& source, std::uint64_t memory_bytes) {
  std::vector<char> bytes;
  bytes.reserve(static_cast<std::size_t>(std::min(source.content_bytes(), memory_bytes)));
  do {
    if (bytes.size() + source.available() > memory_bytes) {
      throw ResourceError(source.path() + ": this Draco file alone takes more than the " +
                          std::to_string(memory_bytes >> 20) +
                          " MiB allowed for decoding it. Raise --memory, or convert the scan to "
                          "PLY, which is read as a stream.");
    }
    bytes.insert(bytes.end(), source.data(), source.data() + source.available());
    source.consume(source.available());
  } while (source.fill(1));
  return bytes;
}

// Where Rattan's own files put coordinates that 32 bits cannot hold.
Vec3d origin_of(const draco::Mesh& mesh) {
  const draco::GeometryMetadata* about = mesh.GetMetadata();
  std::vector<double> origin;
  if (about != nullptr && about->GetEntryDoubleArray("origin", &origin) && origin.size() == 3) {
    Vec3d point(origin[0], origin[1], origin[2]);
    if (point.allFinite()) {
      return point;
    }
  }
  return Vec3d::Zero();
}

/// Colours of points, whatever their type.
class DracoColours {
 public:
  explicit DracoColours(const draco::Mesh& mesh)
      : attribute_(mesh.GetNamedAttribute(draco::GeometryAttribute::COLOR)) {
    if (attribute_ != nullptr &&
        (attribute_->num_components() < 3 || attribute_->num_components() > 4 ||
         !holds_numbers(*attribute_) || attribute_->size() == 0)) {
      attribute_ = nullptr;
    }
  }
  bool present() const { return attribute_ != nullptr; }
  ScanColour of(std::uint32_t point) const {
    if (point == kNone) {
      return {255, 255, 255, 255};  // no triangle uses the vertex
    }
    const draco::AttributeValueIndex at = attribute_->mapped_index(draco::PointIndex(point));
    std::array<double, 4> values{0.0, 0.0, 0.0, 0.0};
    if (at.value() >= attribute_->size()) {
      return {255, 255, 255, 255};
    }
    const int count = attribute_->num_components();
    if (attribute_->data_type() == draco::DT_UINT8) {
      ScanColour colour{0, 0, 0, 255};
      attribute_->GetValue(at, colour.data());
      return colour;
    }
    if (attribute_->data_type() == draco::DT_UINT16) {
      std::array<std::uint16_t, 4> words{0, 0, 0, 65535};
      attribute_->GetValue(at, words.data());
      ScanColour colour{};
      for (std::size_t c = 0; c < 4; ++c) {
        colour[c] = static_cast<std::uint8_t>((words[c] + 128U) / 257U);
      }
      return colour;
    }
    if (!attribute_->ConvertValue<double>(at, static_cast<std::int8_t>(count), values.data())) {
      return {255, 255, 255, 255};
    }
    return colour_of_numbers(values.data(), count);
  }

 private:
  const draco::PointAttribute* attribute_;
};

}  // namespace

void read_draco(ByteSource& source, ScanBlocks& blocks, ScanFileInfo& info,
                std::uint64_t memory_bytes) {
  info.format = "Draco";
  std::unique_ptr<draco::Mesh> mesh;
  {
    const std::vector<char> bytes = read_whole(source, memory_bytes);
    mesh = decode_draco_mesh({bytes.data(), bytes.size()}, source.path(), memory_bytes);
  }
  const auto* position = mesh->GetNamedAttribute(draco::GeometryAttribute::POSITION);
  if (position == nullptr || position->num_components() != 3) {
    throw InputError(source.path(), "", "it holds no positions", kRepair);
  }
  info.vertices = position->size();
  info.triangles = mesh->num_faces();

  // A vertex is a position; points that share one differ in normals or the like. Its colour is that
  // of the first.
  const auto vertex_of = [&](draco::PointIndex point) -> std::uint32_t {
    if (point.value() >= mesh->num_points()) {
      return kNone;
    }
    return position->mapped_index(point).value();
  };
  const DracoColours colours(*mesh);
  std::vector<std::uint32_t> point_of;
  if (colours.present()) {
    blocks.expect_colours();
    point_of.assign(position->size(), kNone);
    for (std::uint32_t p = 0; p < mesh->num_points(); ++p) {
      const std::uint32_t v = vertex_of(draco::PointIndex(p));
      if (v < point_of.size() && point_of[v] == kNone) {
        point_of[v] = p;
      }
    }
  }
  const Vec3d origin = origin_of(*mesh);
  const bool numbers = holds_numbers(*position);
  for (std::uint32_t v = 0; v < position->size(); ++v) {
    std::array<double, 3> p{};
    if (!numbers || !position->ConvertValue<double, 3>(draco::AttributeValueIndex(v), p.data())) {
      throw InputError(source.path(), "", "its positions are of a kind that cannot be read",
                       kRepair);
    }
    blocks.add_vertex(p[0] + origin[0], p[1] + origin[1], p[2] + origin[2]);
    if (colours.present()) {
      blocks.add_colour(colours.of(point_of[v]));
    }
  }
  for (std::uint32_t f = 0; f < mesh->num_faces(); ++f) {
    const draco::Mesh::Face& face = mesh->face(draco::FaceIndex(f));
    std::array<std::uint32_t, 3> v{};
    for (std::size_t c = 0; c < 3; ++c) {
      v[c] = vertex_of(face[static_cast<int>(c)]);
      if (v[c] >= position->size()) {
        throw InputError(source.path(), "triangle " + std::to_string(f),
                         "it refers to a vertex that is not there", kRepair);
      }
    }
    blocks.add_triangle(v[0], v[1], v[2]);
  }
}

}  // namespace rattan
