// SPDX-License-Identifier: MIT
#include <bit>
#include <charconv>
#include <cstring>

#include "engine/core/errors.h"
#include "io/remesh/polygon_files.h"

namespace rattan {
namespace {

static_assert(std::endian::native == std::endian::little, "binary PLY is written as it lies");

class Line {
 public:
  explicit Line(AtomicFile& out) : out_(out) {}
  void text(std::string_view s) { out_.write(s); }
  template <class Number>
  void number(Number value) {
    char digits[32];
    const auto end = std::to_chars(digits, digits + sizeof(digits), value).ptr;
    out_.write(std::string_view(digits, static_cast<std::size_t>(end - digits)));
  }
  void point(const Vec3d& p) {
    for (int k = 0; k < 3; ++k) {
      text(k == 0 ? "" : " ");
      number(p[k]);
    }
  }

 private:
  AtomicFile& out_;
};

/// A comment line each; line breaks inside a string become spaces.
void write_comments(Line& line, std::string_view lead, const RemeshMetadata& metadata) {
  const auto put = [&](std::string_view name, std::string value) {
    if (!value.empty()) {
      for (char& c : value) {
        c = c == '\n' || c == '\r' ? ' ' : c;
      }
      line.text(lead);
      line.text(name);
      line.text(value);
      line.text("\n");
    }
  };
  put("", metadata.version.empty() ? "rattan" : "rattan " + metadata.version);
  put("options ", metadata.options);
  put("input sha256 ", metadata.input_hash);
}

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
