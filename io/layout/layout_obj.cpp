// SPDX-License-Identifier: MIT
#include <charconv>
#include <string>
#include <string_view>
#include <system_error>

#include "engine/core/errors.h"
#include "io/file/byte_source.h"
#include "io/file/text_numbers.h"
#include "io/file/text_writer.h"
#include "io/layout/layout_audit.h"
#include "io/layout/layout_files.h"
#include "io/remesh/file_comments.h"
#include "io/scan/scan_reader.h"

namespace rattan {
namespace {

constexpr std::size_t kReadBytes = std::size_t{1} << 20;

float colour_share(std::uint8_t value) {
  return static_cast<float>(value) / 255.0F;
}

/// Line by line through the file that was written, beside the source.
class ObjComparison {
 public:
  explicit ObjComparison(const AtomicFile& file)
      : path_(file.path()), source_(file.temporary_path(), kReadBytes, info_) {}

  void vertex(const Vec3d& position, const Rgba* colour) {
    TextLine words = statement("v");
    for (int k = 0; k < 3; ++k) {
      number(words, position[k], "another position");
    }
    for (std::size_t c = 0; c < 3 && colour != nullptr; ++c) {
      double value = 0.0;
      if (!words.number(value) || static_cast<float>(value) != colour_share((*colour)[c])) {
        refuse("another colour");
      }
    }
    end(words);
  }
  void texture_vertex(const Vec2d& uv) {
    TextLine words = statement("vt");
    number(words, uv[0], "another texture coordinate");
    number(words, uv[1], "another texture coordinate");
    end(words);
  }
  void line(const std::string& meant) {
    if (!next_line() || line_ != meant) {
      refuse("something else than \"" + meant + "\"");
    }
  }
  /// Of numbers that count from 0.
  void corner(TextLine& words, std::uint64_t vertex, std::uint64_t texture_vertex) {
    const std::string_view word = words.word();
    const char* stop = word.data() + word.size();
    std::uint64_t v = 0;
    std::uint64_t t = 0;
    const auto [slash, error] = std::from_chars(word.data(), stop, v);
    if (error != std::errc() || slash == stop || *slash != '/' ||
        std::from_chars(slash + 1, stop, t).ptr != stop || v != vertex + 1 ||
        t != texture_vertex + 1) {
      refuse("another corner of a face");
    }
  }
  TextLine face() { return statement("f"); }
  void end(TextLine& words) {
    if (!words.at_end()) {
      refuse("more on a line");
    }
  }
  void end_of_file() {
    if (next_line()) {
      refuse("more lines");
    }
  }

 private:
  bool next_line() {
    do {
      if (!source_.next_line(line_)) {
        return false;
      }
    } while (line_.starts_with('#'));
    return true;
  }
  TextLine statement(std::string_view keyword) {
    if (!next_line()) {
      refuse("fewer lines");
    }
    TextLine words(line_);
    if (words.word() != keyword) {
      refuse("no " + std::string(keyword));
    }
    return words;
  }
  void number(TextLine& words, double meant, const char* difference) {
    double value = 0.0;
    if (!words.number(value) || value != meant) {
      refuse(difference);
    }
  }
  [[noreturn]] void refuse(const std::string& difference) {
    refuse_layout(path_, "line " + std::to_string(source_.line_number()) + " has " + difference);
  }

  const std::string& path_;
  ScanFileInfo info_;
  ByteSource source_;
  std::string_view line_;
};

void write_header(TextWriter<AtomicFile>& line, const LayoutSize& size,
                  const RemeshMetadata& metadata, const LayoutWriteOptions& options) {
  write_comments(line, "# ", metadata);
  const auto count = [&](std::uint64_t n, std::string_view what) {
    line.text("# ");
    line.number(n);
    line.text(what);
  };
  count(size.vertices, " vertices\n");
  count(size.texture_vertices, " texture vertices\n");
  count(size.triangles, " triangles\n");
  count(size.charts, " charts\n");
  count(size.parts,
        " parts: chart_C, or chart_C_part_K for each corner of one that has not four\n");
  line.text("# chart side ");
  line.number(size.units);
  line.text("\n");
  if (!options.material_file.empty()) {
    line.text("mtllib ");
    line.text(one_line(options.material_file));
    line.text("\n");
  }
}

void compare(LayoutSource& source, const RemeshMetadata& metadata,
             const LayoutWriteOptions& options, const AtomicFile& out) {
  ObjComparison file(out);
  if (!options.material_file.empty()) {
    file.line("mtllib " + one_line(options.material_file));
  }
  source.for_each_vertices([&](const LayoutVertices& block) {
    for (std::size_t v = 0; v < block.position.size(); ++v) {
      file.vertex(full_position(block.position[v], metadata, options),
                  block.colour.empty() ? nullptr : &block.colour[v]);
    }
  });
  if (!options.material.empty()) {
    file.line("usemtl " + one_line(options.material));
  }
  source.for_each_chart([&](const LayoutChart& chart) {
    for (std::size_t part = 0; part + 1 < chart.part_begin.size(); ++part) {
      file.line("g " + group_name(chart, part));
      for (std::size_t v = chart.part_uv_begin[part]; v < chart.part_uv_begin[part + 1]; ++v) {
        file.texture_vertex(chart.uv[v]);
      }
      for (std::size_t t = chart.part_begin[part]; t < chart.part_begin[part + 1]; ++t) {
        TextLine words = file.face();
        for (const std::uint32_t v : chart.triangle[t]) {
          file.corner(words, chart.vertex[v], chart.first_texture_vertex + v);
        }
        file.end(words);
      }
    }
  });
  file.end_of_file();
}

}  // namespace

std::uint64_t write_layout_obj(LayoutSource& source, const RemeshMetadata& metadata,
                               const LayoutWriteOptions& options, AtomicFile& file) {
  const LayoutSize size = source.size();
  TextWriter line(file);
  write_header(line, size, metadata, options);
  LayoutAudit audit(size);
  source.for_each_vertices([&](const LayoutVertices& block) {
    audit.vertices(block);
    for (std::size_t v = 0; v < block.position.size(); ++v) {
      line.text("v ");
      line.point(full_position(block.position[v], metadata, options));
      for (std::size_t c = 0; c < 3 && size.has_colours; ++c) {
        line.text(" ");
        line.number(colour_share(block.colour[v][c]));
      }
      line.text("\n");
    }
  });
  audit.end_vertices();
  if (!options.material.empty()) {
    line.text("usemtl ");
    line.text(one_line(options.material));
    line.text("\n");
  }
  std::uint64_t folded = 0;
  source.for_each_chart([&](const LayoutChart& chart) {
    audit.chart(chart);
    for (std::size_t part = 0; part + 1 < chart.part_begin.size(); ++part) {
      line.text("g ");
      line.text(group_name(chart, part));
      line.text("\n");
      for (std::size_t v = chart.part_uv_begin[part]; v < chart.part_uv_begin[part + 1]; ++v) {
        line.text("vt ");
        line.number(chart.uv[v][0]);
        line.text(" ");
        line.number(chart.uv[v][1]);
        line.text("\n");
      }
      for (std::size_t t = chart.part_begin[part]; t < chart.part_begin[part + 1]; ++t) {
        const auto& triangle = chart.triangle[t];
        line.text("f");
        for (const std::uint32_t v : triangle) {
          line.text(" ");
          line.number(chart.vertex[v] + 1);
          line.text("/");
          line.number(chart.first_texture_vertex + v + 1);
        }
        line.text("\n");
        folded +=
            counter_clockwise(chart.uv[triangle[0]], chart.uv[triangle[1]], chart.uv[triangle[2]])
                ? 0
                : 1;
      }
    }
  });
  audit.end_charts();
  prepare_reading(file, options);
  compare(source, metadata, options, file);
  return folded;
}

}  // namespace rattan
