// SPDX-License-Identifier: MIT
// A layout as a Draco mesh. Positions are shared across charts and parts; a texture vertex is a
// point. Nothing is deduplicated, and the encoder's speed is at most 5, beyond which it would cut
// the surface along the seams.

#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <draco/compression/expert_encode.h>
#include <draco/core/options.h>
#include <draco/mesh/mesh.h>

#include "engine/core/errors.h"
#include "io/file/guarded_draco.h"
#include "io/layout/layout_audit.h"
#include "io/layout/layout_files.h"
#include "io/layout/texture_grid.h"
#include "io/layout/textured_mesh.h"
#include "io/remesh/draco_grid.h"

namespace rattan {
namespace {

constexpr const char* kChart = "chart";
constexpr const char* kChartUnits = "chart_units";

struct Collected {
  TexturedMesh mesh;  // positions as the file's quantiser gets them
  PositionGrid grid;
  TextureGrid texture;
};

void check_counts(const LayoutSize& size, const std::string& path) {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 30;
  if (size.texture_vertices >= kMost || size.triangles >= kMost) {
    throw UsageError(path + ": a Draco file holds below 2^30 triangles and texture vertices, and " +
                     "this layout has " + std::to_string(size.triangles) + " and " +
                     std::to_string(size.texture_vertices) + ". Write it as .ply or .obj.");
  }
}

Collected collect(LayoutSource& source, const RemeshMetadata& metadata,
                  const LayoutWriteOptions& options) {
  const LayoutSize size = source.size();
  Collected out;
  TexturedMesh& mesh = out.mesh;
  mesh.vertex.reserve(size.texture_vertices);
  mesh.chart.reserve(size.texture_vertices);
  mesh.triangle.reserve(size.triangles);
  LayoutAudit audit(size);
  double length = 0.0;
  {
    std::vector<Vec2d> uv;
    uv.reserve(size.texture_vertices);
    source.for_each_chart([&](const LayoutChart& chart) {
      audit.chart(chart);
      const auto first = static_cast<std::uint32_t>(chart.first_texture_vertex);
      uv.insert(uv.end(), chart.uv.begin(), chart.uv.end());
      for (const std::uint64_t v : chart.vertex) {
        mesh.vertex.push_back(static_cast<std::uint32_t>(v));
      }
      mesh.chart.insert(mesh.chart.end(), chart.uv.size(), chart.chart);
      for (const auto& [a, b, c] : chart.triangle) {
        mesh.triangle.push_back({first + a, first + b, first + c});
        const Vec3d* p = chart.position.data();
        length += (p[b] - p[a]).norm() + (p[c] - p[b]).norm() + (p[a] - p[c]).norm();
      }
    });
    audit.end_charts();
    out.texture = choose_texture_grid(uv, mesh.triangle, options.texture_bits);
    mesh.uv.reserve(uv.size());
    for (const Vec2d& p : uv) {
      mesh.uv.push_back(out.texture.round(p));
    }
  }
  std::vector<std::uint8_t> used(size.vertices, 0);
  for (const std::uint32_t v : mesh.vertex) {
    used[v] = 1;
  }
  for (const std::uint8_t u : used) {
    ensure(u != 0, "every vertex of a layout is used");
  }
  PositionBox box;
  source.for_each_vertices([&](const LayoutVertices& block) {
    audit.vertices(block);
    for (const Vec3d& p : block.position) {
      box.add(p * options.unit);
    }
  });
  audit.end_vertices();
  const double mean =
      options.unit * length / static_cast<double>(3 * std::max<std::uint64_t>(size.triangles, 1));
  const double accuracy =
      options.position_accuracy > 0.0 ? options.position_accuracy : default_accuracy(box, mean);
  out.grid = choose_position_grid(box, metadata.origin, options.position_bits, accuracy);
  mesh.position.reserve(size.vertices);
  mesh.colour.reserve(size.has_colours ? size.vertices : 0);
  source.for_each_vertices([&](const LayoutVertices& block) {
    for (const Vec3d& p : block.position) {
      const Vec3f in = out.grid.to_file(p * options.unit);
      mesh.position.push_back({in[0], in[1], in[2]});
    }
    mesh.colour.insert(mesh.colour.end(), block.colour.begin(), block.colour.end());
  });
  return out;
}

bool has_alpha(const std::vector<Rgba>& colours) {
  for (const Rgba& c : colours) {
    if (c[3] != 255) {
      return true;
    }
  }
  return false;
}

/// Attribute ids.
struct Attributes {
  int position = -1;
  int texture = -1;
  int chart = -1;
};

Attributes fill(const TexturedMesh& mesh, std::uint32_t charts, draco::Mesh& out) {
  const auto vertices = static_cast<std::uint32_t>(mesh.position.size());
  const auto points = static_cast<std::uint32_t>(mesh.uv.size());
  out.SetNumFaces(mesh.triangle.size());
  out.set_num_points(points);
  for (std::uint32_t t = 0; t < mesh.triangle.size(); ++t) {
    const auto& [a, b, c] = mesh.triangle[t];
    out.SetFace(draco::FaceIndex(t),
                {draco::PointIndex(a), draco::PointIndex(b), draco::PointIndex(c)});
  }
  using draco::GeometryAttribute;
  Attributes ids;
  GeometryAttribute attribute;
  attribute.Init(GeometryAttribute::POSITION, nullptr, 3, draco::DT_FLOAT32, false,
                 3 * sizeof(float), 0);
  ids.position = out.AddAttribute(attribute, false, vertices);
  attribute.Init(GeometryAttribute::TEX_COORD, nullptr, 2, draco::DT_FLOAT32, false,
                 2 * sizeof(float), 0);
  ids.texture = out.AddAttribute(attribute, true, points);
  attribute.Init(GeometryAttribute::GENERIC, nullptr, 1, draco::DT_UINT32, false,
                 sizeof(std::uint32_t), 0);
  ids.chart = out.AddAttribute(attribute, false, charts);
  int colour = -1;
  if (!mesh.colour.empty()) {
    const std::int8_t channels = has_alpha(mesh.colour) ? 4 : 3;
    attribute.Init(GeometryAttribute::COLOR, nullptr, channels, draco::DT_UINT8, true, channels, 0);
    colour = out.AddAttribute(attribute, false, vertices);
  }
  for (std::uint32_t v = 0; v < vertices; ++v) {
    const draco::AttributeValueIndex value(v);
    out.attribute(ids.position)->SetAttributeValue(value, mesh.position[v].data());
    if (colour >= 0) {
      out.attribute(colour)->SetAttributeValue(value, mesh.colour[v].data());
    }
  }
  for (std::uint32_t c = 0; c < charts; ++c) {
    out.attribute(ids.chart)->SetAttributeValue(draco::AttributeValueIndex(c), &c);
  }
  for (std::uint32_t i = 0; i < points; ++i) {
    const draco::PointIndex point(i);
    const draco::AttributeValueIndex vertex(mesh.vertex[i]);
    out.attribute(ids.position)->SetPointMapEntry(point, vertex);
    out.attribute(ids.texture)->SetAttributeValue(draco::AttributeValueIndex(i), mesh.uv[i].data());
    out.attribute(ids.chart)->SetPointMapEntry(point, draco::AttributeValueIndex(mesh.chart[i]));
    if (colour >= 0) {
      out.attribute(colour)->SetPointMapEntry(point, vertex);
    }
  }
  return ids;
}

void add_metadata(draco::Mesh& out, const Attributes& ids, const RemeshMetadata& metadata,
                  const PositionGrid& grid, std::uint32_t units) {
  auto about = draco_metadata(metadata, grid);
  about->AddEntryInt(kChartUnits, static_cast<std::int32_t>(units));
  out.AddMetadata(std::move(about));
  auto name = std::make_unique<draco::AttributeMetadata>();
  name->AddEntryString("name", kChart);
  out.AddAttributeMetadata(ids.chart, std::move(name));
}

/// Draco's own way to set the grid passes the range through six decimals; a string keeps all.
draco::Options quantisation_of(const TextureGrid& grid) {
  draco::Options options;
  options.SetInt("quantization_bits", grid.bits);
  char range[32];
  const auto end = std::to_chars(range, range + sizeof(range), grid.range()).ptr;
  options.SetString("quantization_range", std::string(range, end));
  options.SetString("quantization_origin",
                    std::to_string(grid.low[0]) + " " + std::to_string(grid.low[1]));
  return options;
}

std::string encode(const Collected& layout, std::uint32_t charts, std::uint32_t units,
                   const RemeshMetadata& metadata, const LayoutWriteOptions& options) {
  ensure(options.draco_speed >= 0 && options.draco_speed <= 5,
         "Draco keeps vertices whole at encoder speeds 0 to 5 only");
  draco::Mesh mesh;
  const Attributes ids = fill(layout.mesh, charts, mesh);
  add_metadata(mesh, ids, metadata, layout.grid, units);
  draco::ExpertEncoder encoder(mesh);
  encoder.SetSpeedOptions(options.draco_speed, options.draco_speed);
  encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
  encoder.SetAttributeQuantization(ids.position, layout.grid.bits);
  if (layout.texture.quantised) {
    encoder.options().SetAttributeOptions(ids.texture, quantisation_of(layout.texture));
  }
  draco::EncoderBuffer buffer;
  const draco::Status status = encoder.EncodeToBuffer(&buffer);
  if (!status.ok()) {
    throw InternalError("Draco cannot encode the layout: " + status.error_msg_string());
  }
  return {buffer.data(), buffer.size()};
}

/// Empty unless it holds positions, texture coordinates and the charts, as we write them.
TexturedMesh textured_mesh_of(const draco::Mesh& mesh) {
  TexturedMesh out;
  using draco::GeometryAttribute;
  const auto* position = mesh.GetNamedAttribute(GeometryAttribute::POSITION);
  const auto* texture = mesh.GetNamedAttribute(GeometryAttribute::TEX_COORD);
  const auto* colour = mesh.GetNamedAttribute(GeometryAttribute::COLOR);
  const auto* name = mesh.GetMetadata() == nullptr
                         ? nullptr
                         : mesh.GetMetadata()->GetAttributeMetadataByStringEntry("name", kChart);
  const auto* chart =
      name == nullptr ? nullptr : mesh.GetAttributeByUniqueId(name->att_unique_id());
  const auto is = [](const draco::PointAttribute* a, draco::DataType type, int components) {
    return a != nullptr && a->data_type() == type && a->num_components() == components;
  };
  if (!is(position, draco::DT_FLOAT32, 3) || !is(texture, draco::DT_FLOAT32, 2) ||
      !is(chart, draco::DT_UINT32, 1)) {
    return out;
  }
  out.position.resize(position->size());
  for (std::uint32_t v = 0; v < position->size(); ++v) {
    position->GetValue(draco::AttributeValueIndex(v), out.position[v].data());
  }
  if (colour != nullptr) {
    out.colour.assign(position->size(), Rgba{0, 0, 0, 255});
  }
  // A texture vertex is a value of the attribute, which points may share.
  const auto texture_vertices = static_cast<std::uint32_t>(texture->size());
  out.uv.resize(texture_vertices);
  out.vertex.assign(texture_vertices, 0);
  out.chart.assign(texture_vertices, 0);
  for (std::uint32_t i = 0; i < mesh.num_points(); ++i) {
    const draco::PointIndex point(i);
    const std::uint32_t v = position->mapped_index(point).value();
    const std::uint32_t t = texture->mapped_index(point).value();
    texture->GetMappedValue(point, out.uv[t].data());
    chart->GetMappedValue(point, &out.chart[t]);
    out.vertex[t] = v;
    if (colour != nullptr) {
      colour->GetMappedValue(point, out.colour[v].data());
    }
  }
  out.triangle.reserve(mesh.num_faces());
  for (std::uint32_t f = 0; f < mesh.num_faces(); ++f) {
    const draco::Mesh::Face& face = mesh.face(draco::FaceIndex(f));
    out.triangle.push_back({texture->mapped_index(face[0]).value(),
                            texture->mapped_index(face[1]).value(),
                            texture->mapped_index(face[2]).value()});
  }
  return out;
}

/// Makes of the positions what the quantiser does. False if one moves further than the grid says.
void quantise(TexturedMesh& mesh, const PositionGrid& grid) {
  const GridRounding round(grid);
  for (std::array<float, 3>& p : mesh.position) {
    const std::array<float, 3> q = round(Vec3f(p[0], p[1], p[2]));
    for (std::size_t k = 0; k < 3; ++k) {
      ensure(std::abs(static_cast<double>(q[k]) - static_cast<double>(p[k])) <= grid.bound,
             "Draco keeps positions within the quantisation bound");
    }
    p = q;
  }
}

}  // namespace

LayoutWriteResult write_layout_draco(LayoutSource& source, const RemeshMetadata& metadata,
                                     const LayoutWriteOptions& options, AtomicFile& file) {
  const LayoutSize size = source.size();
  check_counts(size, file.path());
  Collected layout = collect(source, metadata, options);
  file.write(encode(layout, size.charts, size.units, metadata, options));
  prepare_reading(file, options);

  quantise(layout.mesh, layout.grid);
  TexturedMesh read;
  RemeshMetadata about;
  {
    const std::string bytes = read_file(file.temporary_path());
    const auto mesh =
        decode_draco_mesh(bytes, file.path(), std::numeric_limits<std::uint64_t>::max());
    about = metadata_of(*mesh);
    read = textured_mesh_of(*mesh);
  }
  const std::string difference = difference_of(layout.mesh, read);
  if (!difference.empty()) {
    refuse_layout(file.path(), difference);
  }
  if (about.origin != layout.grid.origin || about.options != metadata.options ||
      about.input_hash != metadata.input_hash) {
    refuse_layout(file.path(), "its metadata is not what was meant");
  }
  LayoutWriteResult result;
  result.origin = layout.grid.origin;
  result.position_bits = layout.grid.bits;
  result.position_bound = layout.grid.bound;
  result.texture_step = layout.texture.step();
  result.folded = layout.texture.folded;
  return result;
}

}  // namespace rattan
