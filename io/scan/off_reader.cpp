// SPDX-License-Identifier: MIT
#include <algorithm>

#include "io/file/text_numbers.h"
#include "io/scan/scan_parsers.h"

namespace rattan {
namespace {

constexpr const char* kRepair = "Export the scan again or correct the line";

// Next line with anything but a comment in it, without the comment.
bool next_content(ByteSource& source, std::string_view& line) {
  while (source.next_line(line)) {
    line = line.substr(0, line.find('#'));
    if (!TextLine(line).at_end()) {
      return true;
    }
  }
  return false;
}

std::string_view expect_content(ByteSource& source, const char* what, std::uint64_t number) {
  std::string_view line;
  if (!next_content(source, line)) {
    source.fail_at_line(std::string("the file ends before ") + what + std::to_string(number),
                        "It is cut off; copy or export it again");
  }
  return line;
}

std::uint64_t read_count(ByteSource& source, TextLine& words, const char* what) {
  std::int64_t count = 0;
  if (!words.integer(count) || count < 0) {
    source.fail_at_line(std::string("the number of ") + what + " is " + quoted(words.word()) +
                            " instead of a count",
                        kRepair);
  }
  return static_cast<std::uint64_t>(count);
}

// What the keyword says of a vertex line beyond the position: normal, colour and texture coordinate
// follow in this order. Without a keyword nothing does.
struct OffVertex {
  bool normal = false;
  bool colour = false;
  bool texture = false;
};

OffVertex vertex_of(std::string_view keyword) {
  OffVertex vertex;
  vertex.texture = keyword.starts_with("ST");
  keyword.remove_prefix(vertex.texture ? 2 : 0);
  vertex.colour = keyword.starts_with("C");
  keyword.remove_prefix(vertex.colour ? 1 : 0);
  vertex.normal = keyword.starts_with("N");
  return vertex;
}

// Three or four numbers: shares of full colour if they are written with a point or include an alpha
// of at most 1, else shares of 255.
ScanColour read_colour(TextLine words, const OffVertex& vertex) {
  double values[9];
  int count = 0;
  bool point = false;
  while (count < 9) {
    TextLine ahead = words;
    const std::string_view word = ahead.word();
    if (!words.number(values[count])) {
      break;
    }
    if (count >= (vertex.normal ? 3 : 0)) {
      point = point || word.find_first_of(".eE") != std::string_view::npos;
    }
    ++count;
  }
  const double* colour = values + (vertex.normal ? 3 : 0);
  const int components = count - (vertex.normal ? 3 : 0) - (vertex.texture ? 2 : 0);
  if (components < 3) {
    return {255, 255, 255, 255};  // the keyword promises what the line does not keep
  }
  const int used = std::min(components, 4);
  if (!point && used == 3) {
    double bytes[4] = {colour[0], colour[1], colour[2], 255.0};
    return colour_of_numbers(bytes, 4);
  }
  return colour_of_numbers(colour, used);
}

}  // namespace

// [ST][C][N]OFF; positions come first in a vertex line whatever follows them.
bool is_off_keyword(std::string_view line) {
  std::string_view word = TextLine(line).word();
  for (const std::string_view prefix : {"ST", "C", "N"}) {
    if (word.starts_with(prefix)) {
      word.remove_prefix(prefix.size());
    }
  }
  return word == "OFF" || word == "4OFF" || word == "nOFF" || word == "4nOFF";
}

void read_off(ByteSource& source, ScanBlocks& blocks, ScanFileInfo& info) {
  info.format = "OFF";
  std::string_view line = expect_content(source, "count ", 1);
  TextLine words(line);
  OffVertex vertex;
  if (is_off_keyword(line)) {
    const std::string_view keyword = words.word();
    vertex = vertex_of(keyword);
    if (keyword.find('4') != std::string_view::npos ||
        keyword.find('n') != std::string_view::npos) {
      source.fail_at_line("only three-dimensional OFF is read", "Export the scan as plain OFF");
    }
    TextLine ahead = words;
    if (ahead.word() == "BINARY") {
      source.fail_at_line("binary OFF is not read",
                          std::string("Convert the scan to ") + kSupportedFormats);
    }
    if (words.at_end()) {
      line = expect_content(source, "count ", 1);
      words = TextLine(line);
    }
  }
  const std::uint64_t vertices = read_count(source, words, "vertices");
  const std::uint64_t faces = read_count(source, words, "faces");
  info.vertices = vertices;
  info.triangles = faces;

  if (vertex.colour) {
    blocks.expect_colours();
  }
  for (std::uint64_t v = 0; v < vertices; ++v) {
    words = TextLine(expect_content(source, "vertex ", v));
    double p[3];
    for (double& value : p) {
      if (!words.number(value)) {
        const std::string_view word = words.word();
        source.fail_at_line(word.empty() ? "a vertex has fewer than three coordinates"
                                         : quoted(word) + " is not a number",
                            kRepair);
      }
    }
    blocks.add_vertex(p[0], p[1], p[2]);
    if (vertex.colour) {
      blocks.add_colour(read_colour(words, vertex));
    }
  }
  for (std::uint64_t f = 0; f < faces; ++f) {
    words = TextLine(expect_content(source, "face ", f));
    std::uint64_t corners = read_count(source, words, "corners");
    blocks.begin_polygon();
    for (; corners > 0; --corners) {
      std::int64_t index = 0;
      if (!words.integer(index)) {
        const std::string_view word = words.word();
        source.fail_at_line(word.empty() ? "a face has fewer corners than it says"
                                         : quoted(word) + " is not a vertex of a face",
                            kRepair);
      }
      if (index < 0 || static_cast<std::uint64_t>(index) >= vertices) {
        source.fail_at_line("a face refers to vertex " + std::to_string(index) + " of " +
                                std::to_string(vertices) + " (counted from 0)",
                            kRepair);
      }
      blocks.add_corner(static_cast<std::uint64_t>(index));
    }
    blocks.end_polygon();
  }
}

}  // namespace rattan
