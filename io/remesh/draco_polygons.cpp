// SPDX-License-Identifier: MIT
#include "io/remesh/draco_polygons.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <new>
#include <vector>

#include <draco/compression/decode.h>
#include <draco/compression/expert_encode.h>
#include <draco/core/quantization_utils.h>
#include <draco/mesh/mesh.h>

#include "engine/core/errors.h"
#include "io/remesh/polygon_triangles.h"

namespace rattan {
namespace {

constexpr const char* kAddedEdges = "added_edges";
constexpr const char* kGenerator = "generator";
constexpr const char* kOptions = "options";
constexpr const char* kInputHash = "input_sha256";
constexpr const char* kOrigin = "origin";

double float_ulp(double magnitude) {
  const float m = static_cast<float>(magnitude);
  return static_cast<double>(std::nextafter(m, std::numeric_limits<float>::infinity())) -
         static_cast<double>(m);
}

struct Box {
  Vec3d low = Vec3d::Constant(std::numeric_limits<double>::infinity());
  Vec3d high = -low;

  explicit Box(const PolygonMesh& mesh) {
    for (const Vec3d& p : mesh.positions) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
  }
  double largest_side() const { return (high - low).maxCoeff(); }
  double largest_coordinate(const Vec3d& offset) const {
    return std::max((low + offset).cwiseAbs().maxCoeff(), (high + offset).cwiseAbs().maxCoeff());
  }
};

/// Where the grid of quantised positions lies.
struct Grid {
  int bits = 0;
  float low[3] = {0.0F, 0.0F, 0.0F};
  float range = 1.0F;
  double step = 0.0;
  double bound = 0.0;
  Vec3d shift;   // file position = mesh position + shift
  Vec3d origin;  // full position = file position + origin
  bool full = true;
};

Grid choose_grid(const PolygonMesh& mesh, const Vec3d& origin, const DracoOptions& options) {
  const Box box(mesh);
  const double side = box.largest_side();
  Grid grid;
  grid.bits = options.position_bits;
  if (grid.bits == 0) {
    const double accuracy = options.accuracy > 0.0 ? options.accuracy : default_accuracy(mesh);
    grid.bits = kLeastPositionBits;
    while (grid.bits < kMostPositionBits && side > accuracy * ((1 << grid.bits) - 1)) {
      ++grid.bits;
    }
  }
  grid.step = (side > 0.0 ? side : 1.0) / ((1 << grid.bits) - 1);
  // float32 must resolve a quarter of a step; else positions stay relative to the scan's origin, or
  // to the corner of the box where that origin is far off too.
  const auto fine = [&](const Vec3d& shift) {
    return float_ulp(box.largest_coordinate(shift)) <= 0.25 * grid.step;
  };
  grid.full = fine(origin) || (origin.isZero(0.0) && side == 0.0);
  grid.shift = grid.full ? origin : Vec3d::Zero();
  grid.origin = grid.full ? Vec3d::Zero() : origin;
  if (!grid.full && !fine(grid.shift)) {
    grid.shift = -box.low;
    grid.origin = origin + box.low;
  }
  // The grid Draco chooses by itself, in its own arithmetic. (Setting one explicitly goes through
  // decimals of six places in 1.5.5, which spoils any other range than whole numbers.)
  grid.range = 0.0F;
  for (int k = 0; k < 3; ++k) {
    grid.low[k] = static_cast<float>(box.low[k] + grid.shift[k]);
    const auto high = static_cast<float>(box.high[k] + grid.shift[k]);
    grid.range = std::max(grid.range, high - grid.low[k]);
  }
  if (grid.range == 0.0F) {
    grid.range = 1.0F;
  }
  grid.step = static_cast<double>(grid.range) / ((1 << grid.bits) - 1);
  // Draco's quantiser computes in float32, which rounds by a step or so at the finest grids.
  grid.bound = grid.step * (0.5 + std::ldexp(1.0, grid.bits - 22)) +
               3.0 * float_ulp(box.largest_coordinate(grid.shift));
  return grid;
}

void add_metadata(draco::Mesh& out, int added_edges, const RemeshMetadata& metadata,
                  const Grid& grid) {
  auto about = std::make_unique<draco::GeometryMetadata>();
  const auto add = [&](const char* name, const std::string& value) {
    if (!value.empty()) {
      about->AddEntryString(name, value);
    }
  };
  add(kGenerator, metadata.version.empty() ? "rattan" : "rattan " + metadata.version);
  add(kOptions, metadata.options);
  add(kInputHash, metadata.input_hash);
  if (!grid.full) {
    about->AddEntryDoubleArray(kOrigin, {grid.origin[0], grid.origin[1], grid.origin[2]});
  }
  out.AddMetadata(std::move(about));
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

void fill_mesh(const PolygonMesh& mesh, const Triangles& triangles, const Grid& grid,
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
    const Vec3f p = (mesh.positions[v] + grid.shift).cast<float>();
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

/// What Draco's quantiser makes of the positions, by its own arithmetic.
PolygonMesh expected_mesh(const PolygonMesh& mesh, const Grid& grid) {
  draco::Quantizer quantizer;
  quantizer.Init(grid.range, (1 << grid.bits) - 1);
  draco::Dequantizer dequantizer;
  ensure(dequantizer.Init(grid.range, (1 << grid.bits) - 1), "Draco takes the quantisation range");
  PolygonMesh out;
  out.face_begin = mesh.face_begin;
  out.corners = mesh.corners;
  out.colours = mesh.colours;
  out.positions.reserve(mesh.vertex_count());
  for (const Vec3d& p : mesh.positions) {
    const Vec3f in = (p + grid.shift).cast<float>();
    Vec3d q;
    for (int k = 0; k < 3; ++k) {
      const float value = dequantizer.DequantizeFloat(quantizer.QuantizeFloat(in[k] - grid.low[k]));
      q[k] = static_cast<double>(value + grid.low[k]);
    }
    out.positions.push_back(q);
  }
  return out;
}

}  // namespace

double default_accuracy(const PolygonMesh& mesh) {
  const Box box(mesh);
  double length = 0.0;
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const auto face = mesh.face(f);
    for (std::size_t i = 0; i < face.size(); ++i) {
      length += (mesh.positions[face[i]] - mesh.positions[face[(i + 1) % face.size()]]).norm();
    }
  }
  const double mean = length / static_cast<double>(std::max<std::size_t>(mesh.corners.size(), 1));
  return std::min(1e-5 * (box.high - box.low).norm(), mean / 200.0);
}

DracoEncoding encode_draco(const PolygonMesh& mesh, const RemeshMetadata& metadata,
                           const DracoOptions& options) {
  if (options.position_bits != 0 &&
      (options.position_bits < kLeastPositionBits || options.position_bits > kMostPositionBits)) {
    throw UsageError("--position-bits takes " + std::to_string(kLeastPositionBits) + " to " +
                     std::to_string(kMostPositionBits) + ", not " +
                     std::to_string(options.position_bits) + ".");
  }
  ensure(options.speed >= 0 && options.speed <= 5,
         "Draco keeps vertices whole at encoder speeds 0 to 5 only");
  ensure(mesh.vertex_count() < (std::size_t{1} << 30), "a Draco file holds below 2^30 vertices");
  const Grid grid = choose_grid(mesh, metadata.origin, options);
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
