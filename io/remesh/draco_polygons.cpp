// SPDX-License-Identifier: MIT
#include "io/remesh/draco_polygons.h"

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <new>
#include <vector>

#include <draco/compression/decode.h>
#include <draco/compression/expert_encode.h>
#include <draco/mesh/mesh.h>

#include "engine/core/errors.h"
#include "io/remesh/draco_grid.h"
#include "io/remesh/polygon_triangles.h"

namespace rattan {
namespace {

constexpr const char* kAddedEdges = "added_edges";
void add_metadata(draco::Mesh& out, int added_edges, const RemeshMetadata& metadata,
                  const PositionGrid& grid) {
  out.AddMetadata(draco_metadata(metadata, grid));
  if (added_edges >= 0) {
    auto name = std::make_unique<draco::AttributeMetadata>();
    name->AddEntryString("name", kAddedEdges);
    out.AddAttributeMetadata(added_edges, std::move(name));
  }
}

/// Triangles whose corners are points: a vertex with either flag is a point of its own.
struct Triangles {
  std::vector<std::array<std::uint32_t, 3>> corners;  // 2 * vertex + flag until numbered
  std::vector<std::uint32_t> point_of;                // of 2 * vertex + flag
  std::uint32_t points = 0;
  bool has_polygons = false;
};

Triangles cut(const PolygonMesh& mesh) {
  const std::vector<std::uint32_t> apex = choose_fan_apexes(mesh);
  Triangles out;
  out.corners.reserve(mesh.corners.size() - 2 * mesh.face_count());
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const auto face = mesh.face(f);
    const std::size_t n = face.size();
    for (std::size_t t = 0; t + 2 < n; ++t) {
      const std::uint32_t splits = t + 3 < n ? 1 : 0;
      out.has_polygons = out.has_polygons || splits == 1;
      out.corners.push_back({2 * face[apex[f]], 2 * face[(apex[f] + t + 1) % n] + splits,
                             2 * face[(apex[f] + t + 2) % n]});
    }
  }
  constexpr auto kUnused = std::numeric_limits<std::uint32_t>::max();
  out.point_of.assign(2 * mesh.vertex_count(), kUnused);
  for (const auto& triangle : out.corners) {
    for (const std::uint32_t c : triangle) {
      out.point_of[c] = 0;
    }
  }
  for (std::uint32_t& point : out.point_of) {
    if (point != kUnused) {
      point = out.points++;
    }
  }
  return out;
}

void fill_mesh(const PolygonMesh& mesh, const Triangles& triangles, const PositionGrid& grid,
               draco::Mesh& out, int& position, int& added_edges) {
  out.SetNumFaces(triangles.corners.size());
  out.set_num_points(triangles.points);
  draco::GeometryAttribute attribute;
  attribute.Init(draco::GeometryAttribute::POSITION, nullptr, 3, draco::DT_FLOAT32, false,
                 sizeof(float) * 3, 0);
  position = out.AddAttribute(attribute, false, static_cast<std::uint32_t>(mesh.vertex_count()));
  added_edges = -1;
  if (triangles.has_polygons) {
    attribute.Init(draco::GeometryAttribute::GENERIC, nullptr, 1, draco::DT_UINT8, false, 1, 0);
    added_edges = out.AddAttribute(attribute, false, 2);
    for (const std::uint8_t flag : {std::uint8_t{0}, std::uint8_t{1}}) {
      out.attribute(added_edges)->SetAttributeValue(draco::AttributeValueIndex(flag), &flag);
    }
  }
  int colour = -1;
  if (!mesh.colours.empty()) {
    const std::int8_t channels = mesh.has_alpha() ? 4 : 3;
    attribute.Init(draco::GeometryAttribute::COLOR, nullptr, channels, draco::DT_UINT8, true,
                   channels, 0);
    colour = out.AddAttribute(attribute, false, static_cast<std::uint32_t>(mesh.vertex_count()));
  }
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    const draco::AttributeValueIndex value(v);
    const Vec3f p = grid.to_file(mesh.positions[v]);
    out.attribute(position)->SetAttributeValue(value, p.data());
    if (colour >= 0) {
      out.attribute(colour)->SetAttributeValue(value, mesh.colours[v].data());
    }
  }
  for (std::uint32_t i = 0; i < triangles.point_of.size(); ++i) {
    const draco::PointIndex point(triangles.point_of[i]);
    if (point.value() != std::numeric_limits<std::uint32_t>::max()) {
      out.attribute(position)->SetPointMapEntry(point, draco::AttributeValueIndex(i / 2));
      if (colour >= 0) {
        out.attribute(colour)->SetPointMapEntry(point, draco::AttributeValueIndex(i / 2));
      }
      if (added_edges >= 0) {
        out.attribute(added_edges)->SetPointMapEntry(point, draco::AttributeValueIndex(i % 2));
      }
    }
  }
  for (std::size_t t = 0; t < triangles.corners.size(); ++t) {
    draco::Mesh::Face face;
    for (std::size_t c = 0; c < 3; ++c) {
      face[c] = draco::PointIndex(triangles.point_of[triangles.corners[t][c]]);
    }
    out.SetFace(draco::FaceIndex(static_cast<std::uint32_t>(t)), face);
  }
}

PolygonMesh expected_mesh(const PolygonMesh& mesh, const PositionGrid& grid) {
  const GridRounding round(grid);
  PolygonMesh out;
  out.face_begin = mesh.face_begin;
  out.corners = mesh.corners;
  out.colours = mesh.colours;
  out.positions.reserve(mesh.vertex_count());
  for (const Vec3d& p : mesh.positions) {
    const std::array<float, 3> q = round(grid.to_file(p));
    out.positions.emplace_back(q[0], q[1], q[2]);
  }
  return out;
}

PositionBox box_of(const PolygonMesh& mesh) {
  PositionBox box;
  for (const Vec3d& p : mesh.positions) {
    box.add(p);
  }
  return box;
}

}  // namespace

double default_accuracy(const PolygonMesh& mesh) {
  double length = 0.0;
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const auto face = mesh.face(f);
    for (std::size_t i = 0; i < face.size(); ++i) {
      length += (mesh.positions[face[i]] - mesh.positions[face[(i + 1) % face.size()]]).norm();
    }
  }
  const double mean = length / static_cast<double>(std::max<std::size_t>(mesh.corners.size(), 1));
  return default_accuracy(box_of(mesh), mean);
}

DracoEncoding encode_draco(const PolygonMesh& mesh, const RemeshMetadata& metadata,
                           const DracoOptions& options) {
  check_position_bits(options.position_bits);
  ensure(options.speed >= 0 && options.speed <= 5,
         "Draco keeps vertices whole at encoder speeds 0 to 5 only");
  ensure(mesh.vertex_count() < (std::size_t{1} << 30), "a Draco file holds below 2^30 vertices");
  const double accuracy = options.accuracy > 0.0 ? options.accuracy : default_accuracy(mesh);
  const PositionGrid grid =
      choose_position_grid(box_of(mesh), metadata.origin, options.position_bits, accuracy);
  DracoEncoding out;
  {
    draco::Mesh triangles;
    int position = -1;
    int added_edges = -1;
    fill_mesh(mesh, cut(mesh), grid, triangles, position, added_edges);
    add_metadata(triangles, added_edges, metadata, grid);
    draco::ExpertEncoder encoder(triangles);
    encoder.SetSpeedOptions(options.speed, options.speed);
    encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
    encoder.SetAttributeQuantization(position, grid.bits);
    draco::EncoderBuffer buffer;
    const draco::Status status = encoder.EncodeToBuffer(&buffer);
    if (!status.ok()) {
      throw InternalError("Draco cannot encode the remesh: " + status.error_msg_string());
    }
    out.bytes.assign(buffer.data(), buffer.size());
  }
  out.position_bits = grid.bits;
  out.step = grid.step;
  out.bound = grid.bound;
  out.origin = grid.origin;
  out.holds_full_coordinates = grid.full;
  out.expected = expected_mesh(mesh, grid);
  return out;
}

}  // namespace rattan
