// SPDX-License-Identifier: MIT
#include <algorithm>
#include <bit>

#include "io/file/text_writer.h"
#include "io/remesh/file_comments.h"
#include "io/remesh/polygon_files.h"

namespace rattan {
namespace {

static_assert(std::endian::native == std::endian::little, "binary PLY is written as it lies");

using Line = TextWriter<AtomicFile>;

}  // namespace

void write_obj(const PolygonMesh& mesh, const RemeshMetadata& metadata, AtomicFile& out) {
  Line line(out);
  write_comments(line, "# ", metadata);
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
    line.text("v ");
    line.point(mesh.positions[v] + metadata.origin);
    for (std::size_t c = 0; c < 3 && !mesh.colours.empty(); ++c) {
      line.text(" ");
      line.number(static_cast<float>(mesh.colours[v][c]) / 255.0F);
    }
    line.text("\n");
  }
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    line.text("f");
    for (const std::uint32_t v : mesh.face(f)) {
      line.text(" ");
      line.number(std::uint64_t{v} + 1);
    }
    line.text("\n");
  }
}

void write_off(const PolygonMesh& mesh, const RemeshMetadata& metadata, AtomicFile& out) {
  Line line(out);
  line.text(mesh.colours.empty() ? "OFF\n" : "COFF\n");
  write_comments(line, "# ", metadata);
  line.number(mesh.vertex_count());
  line.text(" ");
  line.number(mesh.face_count());
  line.text(" 0\n");
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
    line.point(mesh.positions[v] + metadata.origin);
    for (std::size_t c = 0; c < 4 && !mesh.colours.empty(); ++c) {
      line.text(" ");
      line.number(unsigned{mesh.colours[v][c]});
    }
    line.text("\n");
  }
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    line.number(mesh.degree(f));
    for (const std::uint32_t v : mesh.face(f)) {
      line.text(" ");
      line.number(v);
    }
    line.text("\n");
  }
}

void write_ply(const PolygonMesh& mesh, const RemeshMetadata& metadata, AtomicFile& out) {
  std::size_t most = 0;
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    most = std::max(most, mesh.degree(f));
  }
  const bool short_counts = most < 256;
  Line line(out);
  line.text("ply\nformat binary_little_endian 1.0\n");
  write_comments(line, "comment ", metadata);
  line.text("element vertex ");
  line.number(mesh.vertex_count());
  line.text("\nproperty double x\nproperty double y\nproperty double z\n");
  const std::size_t channels = mesh.colours.empty() ? 0 : mesh.has_alpha() ? 4 : 3;
  if (channels > 0) {
    line.text("property uchar red\nproperty uchar green\nproperty uchar blue\n");
    line.text(channels > 3 ? "property uchar alpha\n" : "");
  }
  line.text("element face ");
  line.number(mesh.face_count());
  line.text(short_counts ? "\nproperty list uchar int vertex_indices\nend_header\n"
                         : "\nproperty list uint int vertex_indices\nend_header\n");
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
    const Vec3d full = mesh.positions[v] + metadata.origin;
    out.write(full.data(), 3 * sizeof(double));
    if (channels > 0) {
      out.write(mesh.colours[v].data(), channels);
    }
  }
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const auto count = static_cast<std::uint32_t>(mesh.degree(f));
    out.write(&count, short_counts ? 1 : sizeof(count));
    out.write(mesh.face(f).data(), count * sizeof(std::uint32_t));
  }
}

}  // namespace rattan
