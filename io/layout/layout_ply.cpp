// SPDX-License-Identifier: MIT
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "engine/core/errors.h"
#include "io/file/byte_source.h"
#include "io/file/text_writer.h"
#include "io/layout/layout_audit.h"
#include "io/layout/layout_files.h"
#include "io/remesh/file_comments.h"
#include "io/scan/scan_reader.h"

namespace rattan {
namespace {

static_assert(std::endian::native == std::endian::little, "binary PLY is written as it lies");

constexpr std::size_t kReadBytes = std::size_t{1} << 20;

/// What the header decides.
struct PlyShape {
  std::size_t channels = 0;  // of colours
  bool wide = false;         // texture coordinates are doubles
};

/// One record of the file.
class Record {
 public:
  void clear() { size_ = 0; }
  template <class T>
  void add(T value) {
    std::memcpy(bytes_.data() + size_, &value, sizeof(T));
    size_ += sizeof(T);
  }
  std::string_view bytes() const { return {bytes_.data(), size_}; }

  void set_vertex(const Vec3d& p, const Rgba* colour, const PlyShape& shape) {
    clear();
    for (int k = 0; k < 3; ++k) {
      add(p[k]);
    }
    for (std::size_t c = 0; c < shape.channels; ++c) {
      add((*colour)[c]);
    }
  }
  void set_face(const LayoutChart& chart, std::size_t t, std::uint32_t part,
                const PlyShape& shape) {
    clear();
    add(std::uint8_t{3});
    for (const std::uint32_t v : chart.triangle[t]) {
      add(static_cast<std::uint32_t>(chart.vertex[v]));
    }
    add(std::uint8_t{6});
    for (const std::uint32_t v : chart.triangle[t]) {
      for (int k = 0; k < 2; ++k) {
        if (shape.wide) {
          add(chart.uv[v][k]);
        } else {
          add(static_cast<float>(chart.uv[v][k]));
        }
      }
    }
    add(chart.chart);
    add(part);
  }

 private:
  std::array<char, 80> bytes_{};
  std::size_t size_ = 0;
};

/// f(chart, triangle, part counted over all charts) for all triangles in order.
template <class F>
void for_each_face(LayoutSource& source, const F& f) {
  source.for_each_chart([&](const LayoutChart& chart) {
    for (std::size_t part = 0; part + 1 < chart.part_begin.size(); ++part) {
      for (std::size_t t = chart.part_begin[part]; t < chart.part_begin[part + 1]; ++t) {
        f(chart, t, chart.first_part + static_cast<std::uint32_t>(part));
      }
    }
  });
}

/// Looks through the layout before the header is written.
PlyShape shape_of(LayoutSource& source, std::uint64_t& folded) {
  PlyShape shape;
  const LayoutSize size = source.size();
  LayoutAudit audit(size);
  if (size.has_colours) {
    shape.channels = 3;
    source.for_each_vertices([&](const LayoutVertices& block) {
      for (const Rgba& c : block.colour) {
        shape.channels = c[3] != 255 ? 4 : shape.channels;
      }
    });
  }
  std::uint64_t folded_as_float = 0;
  source.for_each_chart([&](const LayoutChart& chart) {
    audit.chart(chart);
    for (const auto& [a, b, c] : chart.triangle) {
      const Vec2d* uv = chart.uv.data();
      folded += counter_clockwise(uv[a], uv[b], uv[c]) ? 0 : 1;
      folded_as_float += counter_clockwise_as_float(uv[a], uv[b], uv[c]) ? 0 : 1;
    }
  });
  audit.end_charts();
  shape.wide = folded_as_float > folded;
  return shape;
}

class Header {
 public:
  void write(std::string_view bytes) { text_ += bytes; }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

std::string header_of(const LayoutSize& size, const PlyShape& shape, const RemeshMetadata& metadata,
                      const LayoutWriteOptions& options) {
  Header out;
  TextWriter line(out);
  line.text("ply\nformat binary_little_endian 1.0\n");
  write_comments(line, "comment ", metadata);
  if (!options.image_file.empty()) {
    line.text("comment TextureFile ");
    line.text(one_line(options.image_file));
    line.text("\n");
  }
  line.text("comment texcoord: of each part, a chart side is ");
  line.number(size.units);
  line.text(" long; part: counted over all charts\nelement vertex ");
  line.number(size.vertices);
  line.text("\nproperty double x\nproperty double y\nproperty double z\n");
  if (shape.channels > 0) {
    line.text("property uchar red\nproperty uchar green\nproperty uchar blue\n");
    line.text(shape.channels > 3 ? "property uchar alpha\n" : "");
  }
  // Many readers know signed indices only.
  constexpr std::uint64_t kMostSigned = std::numeric_limits<std::int32_t>::max();
  line.text("element face ");
  line.number(size.triangles);
  line.text(size.vertices > kMostSigned ? "\nproperty list uchar uint vertex_indices\n"
                                        : "\nproperty list uchar int vertex_indices\n");
  line.text(shape.wide ? "property list uchar double texcoord\n"
                       : "property list uchar float texcoord\n");
  line.text(size.charts > kMostSigned ? "property uint chart\n" : "property int chart\n");
  line.text(size.parts > kMostSigned ? "property uint part\n" : "property int part\n");
  line.text("end_header\n");
  return out.text();
}

/// What was written, as it is read back.
class PlyComparison {
 public:
  explicit PlyComparison(const AtomicFile& file)
      : path_(file.path()), source_(file.temporary_path(), kReadBytes, info_) {}

  void next(std::string_view meant, const char* what) {
    if (!source_.fill(meant.size()) ||
        std::memcmp(source_.data(), meant.data(), meant.size()) != 0) {
      refuse_layout(path_, "byte " + std::to_string(source_.offset()) + " begins another " + what);
    }
    source_.consume(meant.size());
  }
  void end_of_file() {
    if (source_.fill(1)) {
      refuse_layout(path_, "it goes on behind the last face");
    }
  }

 private:
  const std::string& path_;
  ScanFileInfo info_;
  ByteSource source_;
};

void compare(LayoutSource& source, const RemeshMetadata& metadata,
             const LayoutWriteOptions& options, const PlyShape& shape, const AtomicFile& out) {
  PlyComparison file(out);
  file.next(header_of(source.size(), shape, metadata, options), "header");
  Record record;
  source.for_each_vertices([&](const LayoutVertices& block) {
    for (std::size_t v = 0; v < block.position.size(); ++v) {
      record.set_vertex(full_position(block.position[v], metadata, options),
                        block.colour.empty() ? nullptr : &block.colour[v], shape);
      file.next(record.bytes(), "vertex");
    }
  });
  for_each_face(source, [&](const LayoutChart& chart, std::size_t t, std::uint32_t part) {
    record.set_face(chart, t, part, shape);
    file.next(record.bytes(), "face");
  });
  file.end_of_file();
}

}  // namespace

std::uint64_t write_layout_ply(LayoutSource& source, const RemeshMetadata& metadata,
                               const LayoutWriteOptions& options, AtomicFile& file) {
  const LayoutSize size = source.size();
  if (size.vertices > std::uint64_t{1} << 32) {
    throw UsageError(file.path() + ": a PLY file can number 2^32 vertices, and this layout has " +
                     std::to_string(size.vertices) + ". Write it as .obj.");
  }
  std::uint64_t folded = 0;
  const PlyShape shape = shape_of(source, folded);
  file.write(header_of(size, shape, metadata, options));
  LayoutAudit audit(size);
  Record record;
  source.for_each_vertices([&](const LayoutVertices& block) {
    audit.vertices(block);
    for (std::size_t v = 0; v < block.position.size(); ++v) {
      record.set_vertex(full_position(block.position[v], metadata, options),
                        block.colour.empty() ? nullptr : &block.colour[v], shape);
      file.write(record.bytes());
    }
  });
  audit.end_vertices();
  for_each_face(source, [&](const LayoutChart& chart, std::size_t t, std::uint32_t part) {
    record.set_face(chart, t, part, shape);
    file.write(record.bytes());
  });
  prepare_reading(file, options);
  compare(source, metadata, options, shape, file);
  return folded;
}

}  // namespace rattan
