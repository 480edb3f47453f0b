// SPDX-License-Identifier: MIT
#include <algorithm>

#include "engine/core/errors.h"
#include "io/file/text_numbers.h"
#include "io/scan/obj_statements.h"
#include "io/scan/scan_parsers.h"

namespace rattan {
namespace {

class ObjReader {
 public:
  ObjReader(ByteSource& source, ScanBlocks& blocks) : source_(source), blocks_(blocks) {}

  void read() {
    std::string_view line;
    while (statements_.next(line)) {
      const std::size_t begin = line.find_first_not_of(" \t");
      if (begin == std::string_view::npos || begin + 1 >= line.size()) {
        continue;
      }
      const char keyword = line[begin];
      const char after = line[begin + 1];
      if (after != ' ' && after != '\t') {
        if (line.substr(begin).starts_with("fo ")) {  // a face, in the oldest files
          read_face(line.substr(begin + 3));
        }
        continue;
      }
      if (keyword == 'v') {
        read_vertex(line.substr(begin + 2));
      } else if (keyword == 'f') {
        read_face(line.substr(begin + 2));
      } else if (keyword == 'l') {
        ++lines_;
      }
    }
    if (lines_ > 0 && blocks_.triangles() == 0) {
      throw InputError(source_.path(), "",
                       "the file holds no faces, only " + std::to_string(lines_) +
                           " polylines; it is a wireframe",
                       "Export the surface, not its outline");
    }
    if (highest_ > blocks_.vertices()) {
      throw InputError(source_.path(), "line " + std::to_string(highest_line_),
                       "a face refers to vertex " + std::to_string(highest_) +
                           ", but the file holds only " + std::to_string(blocks_.vertices()),
                       "The file may be cut off; export it again");
    }
  }

 private:
  void read_vertex(std::string_view rest) {
    TextLine words(rest);
    double p[3];
    for (double& value : p) {
      if (!words.number(value)) {
        const std::string_view word = words.word();
        source_.fail_at_line(word.empty() ? "a vertex has fewer than three coordinates"
                                          : quoted(word) + " is not a number",
                             "Export the scan again or correct the line");
      }
    }
    blocks_.add_vertex(p[0], p[1], p[2]);
    read_colour(words);
  }

  // What follows the coordinates: a weight, or a colour with or without alpha. Whether vertices
  // have colours is settled by the first; one without is then white.
  void read_colour(TextLine& words) {
    if (coloured_ == Coloured::kNo) {
      return;
    }
    double values[4] = {1.0, 1.0, 1.0, 1.0};
    int count = 0;
    while (count < 4 && words.number(values[count])) {
      ++count;
    }
    if (coloured_ == Coloured::kUnknown) {
      coloured_ = count >= 3 ? Coloured::kYes : Coloured::kNo;
      if (count < 3) {
        return;
      }
      blocks_.expect_colours();
    }
    blocks_.add_colour(count >= 3 ? colour_of_numbers(values, count)
                                  : ScanColour{255, 255, 255, 255});
  }

  void read_face(std::string_view rest) {
    TextLine words(rest);
    blocks_.begin_polygon();
    while (!words.at_end() && words.peek() != '#') {
      std::int64_t index = 0;
      if (!words.integer(index, '/')) {
        source_.fail_at_line(quoted(words.word()) + " is not a vertex of a face",
                             "Export the scan again or correct the line");
      }
      words.end_word();  // texture and normal: "/2/3", "//3" or nothing
      blocks_.add_corner(vertex_of(index));
    }
    blocks_.end_polygon();
  }

  // From 1 forwards, or from -1 backwards through the vertices read so far.
  std::uint64_t vertex_of(std::int64_t index) {
    const std::uint64_t count = blocks_.vertices();
    if (index > 0) {
      const std::uint64_t wanted = static_cast<std::uint64_t>(index);
      if (wanted > count && wanted > highest_) {
        highest_ = wanted;
        highest_line_ = source_.line_number();
      }
      return wanted - 1;
    }
    const std::uint64_t back = ~static_cast<std::uint64_t>(index) + 1;
    if (index == 0 || back > count) {
      source_.fail_at_line("a face refers to vertex " + std::to_string(index) + " after " +
                               std::to_string(count) + " vertices",
                           "Indices start at 1, or count back from -1; export the scan again");
    }
    return count - back;
  }

  enum class Coloured { kUnknown, kYes, kNo };
  ByteSource& source_;
  ScanBlocks& blocks_;
  ObjStatements statements_{source_, "Check that this is an OBJ file"};
  std::uint64_t highest_ = 0;  // of the references ahead of their vertex
  std::uint64_t highest_line_ = 0;
  std::uint64_t lines_ = 0;
  Coloured coloured_ = Coloured::kUnknown;
};

}  // namespace

void read_obj(ByteSource& source, ScanBlocks& blocks, ScanFileInfo& info) {
  info.format = "OBJ";
  ObjReader(source, blocks).read();
}

}  // namespace rattan
