// SPDX-License-Identifier: MIT
#include <algorithm>
#include <bit>

#include "io/file/text_numbers.h"
#include "io/scan/ply_header.h"
#include "io/scan/ply_values.h"
#include "io/scan/scan_parsers.h"

namespace rattan {
namespace {

constexpr const char* kRepair = "Export the scan again or correct the file";
constexpr const char* kCutOff = "It is cut off; copy or export it again";

enum class Role { kSkip, kVertex, kFace, kStrip };

// A triangle strip: each corner after the second closes a triangle with the two before it, turned
// every other time; -1 starts a new strip.
class Strip {
 public:
  void restart() { length_ = 0; }
  void add(std::uint64_t vertex, ScanBlocks& blocks) {
    if (length_ >= 2 && a_ != b_ && b_ != vertex && vertex != a_) {
      if (length_ % 2 == 0) {
        blocks.add_triangle(a_, b_, vertex);
      } else {
        blocks.add_triangle(b_, a_, vertex);
      }
    }
    a_ = b_;
    b_ = vertex;
    ++length_;
  }

 private:
  std::uint64_t a_ = 0;
  std::uint64_t b_ = 0;
  std::uint64_t length_ = 0;
};

class PlyReader {
 public:
  PlyReader(ByteSource& source, ScanBlocks& blocks, PlyHeader header)
      : source_(source), blocks_(blocks), header_(std::move(header)) {}

  void read(ScanFileInfo& info) {
    check_header(info);
    for (const PlyElement& element : header_.elements) {
      role_ = element.name == "vertex"      ? Role::kVertex
              : element.name == "face"      ? Role::kFace
              : element.name == "tristrips" ? Role::kStrip
                                            : Role::kSkip;
      find_properties(element);
      if (element.properties.empty()) {
        continue;
      }
      switch (header_.encoding) {
        case PlyEncoding::kAscii:
          read_ascii(element);
          break;
        case PlyEncoding::kLittleEndian:
          read_binary<std::endian::native == std::endian::big>(element);
          break;
        case PlyEncoding::kBigEndian:
          read_binary<std::endian::native == std::endian::little>(element);
          break;
      }
    }
  }

 private:
  void check_header(ScanFileInfo& info) {
    const std::uint64_t header_end = source_.offset();
    const PlyElement* vertex = header_.find("vertex");
    const PlyElement* face = header_.find("face");
    const PlyElement* strips = header_.find("tristrips");
    if (vertex == nullptr || vertex->count == 0) {
      source_.fail_at_byte(header_end, "the header declares no vertices", kRepair);
    }
    if ((face == nullptr || face->count == 0) && (strips == nullptr || strips->count == 0)) {
      source_.fail_at_byte(header_end, "the header declares no triangles; this is a point cloud",
                           "Reconstruct a triangle mesh from it first");
    }
    vertices_ = vertex->count;
    info.vertices = vertex->count;
    info.triangles = face != nullptr ? face->count : 0;
    if (header_.encoding == PlyEncoding::kAscii || source_.content_bytes() == 0) {
      return;
    }
    // A binary file that is too short is told before hours are spent on it.
    double least = static_cast<double>(header_end);
    for (const PlyElement& element : header_.elements) {
      least += static_cast<double>(element.count) * static_cast<double>(element.least_bytes());
    }
    if (least > static_cast<double>(source_.content_bytes())) {
      source_.fail_at_byte(source_.content_bytes(),
                           "the file ends too early for the counts in its header", kCutOff);
    }
  }

  void find_properties(const PlyElement& element) {
    list_ = -1;
    if (role_ == Role::kVertex) {
      static constexpr const char* kAxis[] = {"x", "y", "z"};
      for (int k = 0; k < 3; ++k) {
        position_[k] = element.find(kAxis[k]);
        if (position_[k] < 0 || property(element, position_[k]).is_list) {
          source_.fail_at_byte(source_.offset(),
                               std::string("vertices have no coordinate ") + kAxis[k], kRepair);
        }
      }
      colour_ = PlyColour(element);
      if (colour_.count() > 0) {
        blocks_.expect_colours();
      }
    } else if (role_ != Role::kSkip) {
      list_ = element.find("vertex_indices");
      list_ = list_ >= 0 ? list_ : element.find("vertex_index");
      if (element.count == 0) {
        role_ = Role::kSkip;
      } else if (list_ < 0 || !property(element, list_).is_list ||
                 !ply_is_integer(property(element, list_).type)) {
        source_.fail_at_byte(
            source_.offset(),
            "element " + quoted(element.name) + " has no list of integers \"vertex_indices\"",
            kRepair);
      }
    }
  }

  static const PlyProperty& property(const PlyElement& element, int k) {
    return element.properties[static_cast<std::size_t>(k)];
  }

  bool is_vertex(std::int64_t index) const {
    return index >= 0 && static_cast<std::uint64_t>(index) < vertices_;
  }
  std::string bad_index(std::int64_t index) const {
    return "a face refers to vertex " + std::to_string(index) + " of " + std::to_string(vertices_) +
           " (counted from 0)";
  }

  // Writers that know only signed indices let those beyond 2^31 turn negative.
  bool wraps(PlyType type) const {
    return type == PlyType::kInt32 && vertices_ > std::uint64_t{1} << 31;
  }

  // ---- text ----

  void read_ascii(const PlyElement& element) {
    std::string_view line;
    for (std::uint64_t r = 0; r < element.count; ++r) {
      do {
        if (!source_.next_line(line)) {
          source_.fail_at_line("the file ends before " + element.name + " " + std::to_string(r) +
                                   " of " + std::to_string(element.count),
                               kCutOff);
        }
      } while (TextLine(line).at_end());
      if (role_ == Role::kVertex) {
        read_ascii_vertex(element, line);
      } else if (role_ != Role::kSkip) {
        read_ascii_face(element, line);
      }
    }
  }

  void read_ascii_vertex(const PlyElement& element, std::string_view line) {
    TextLine words(line);
    double p[3] = {};
    double colour[4] = {};
    int last = std::max({position_[0], position_[1], position_[2]});
    for (int c = 0; c < colour_.count(); ++c) {
      last = std::max(last, colour_.property(c));
    }
    for (int k = 0; k <= last; ++k) {
      if (property(element, k).is_list) {
        skip_ascii_list(words);
        continue;
      }
      double value = 0.0;
      if (!words.number(value)) {
        fail_word(words, "a number");
      }
      for (int axis = 0; axis < 3; ++axis) {
        if (position_[axis] == k) {
          // Text may carry more digits than the property's type holds: they are kept.
          p[axis] = value;
        }
      }
      if (const int c = colour_.component_of(k); c >= 0) {
        colour[c] = value;
      }
    }
    blocks_.add_vertex(p[0], p[1], p[2]);
    if (colour_.count() > 0) {
      blocks_.add_colour(colour_.of(colour));
    }
  }

  void read_ascii_face(const PlyElement& element, std::string_view line) {
    TextLine words(line);
    for (int k = 0; k < list_; ++k) {
      if (property(element, k).is_list) {
        skip_ascii_list(words);
      } else if (words.word().empty()) {
        fail_word(words, "a value");
      }
    }
    begin_face();
    for (std::int64_t n = ascii_list_length(words); n > 0; --n) {
      std::int64_t index = 0;
      if (!words.integer(index)) {
        fail_word(words, "a vertex of a face");
      }
      if (!add_index(index)) {
        source_.fail_at_line(bad_index(index), kRepair);
      }
    }
    end_face();
  }

  std::int64_t ascii_list_length(TextLine& words) {
    std::int64_t length = 0;
    if (!words.integer(length)) {
      fail_word(words, "the length of a list");
    }
    if (length < 0) {
      source_.fail_at_line("a list has the length " + std::to_string(length), kRepair);
    }
    return length;
  }
  void skip_ascii_list(TextLine& words) {
    for (std::int64_t n = ascii_list_length(words); n > 0; --n) {
      if (words.word().empty()) {
        fail_word(words, "a value");
      }
    }
  }
  [[noreturn]] void fail_word(TextLine& words, const std::string& expected) {
    const std::string_view word = words.word();
    source_.fail_at_line(word.empty() ? "the line ends where " + expected + " should be"
                                      : quoted(word) + " is not " + expected,
                         kRepair);
  }

  // ---- faces, from text or binary ----

  void begin_face() {
    blocks_.begin_polygon();
    strip_.restart();
  }
  bool add_index(std::int64_t index) {
    if (role_ == Role::kStrip && index == -1) {
      strip_.restart();
      return true;
    }
    if (!is_vertex(index)) {
      return false;
    }
    if (role_ == Role::kStrip) {
      strip_.add(static_cast<std::uint64_t>(index), blocks_);
    } else {
      blocks_.add_corner(static_cast<std::uint64_t>(index));
    }
    return true;
  }
  void end_face() {
    if (role_ == Role::kFace) {
      blocks_.end_polygon();
    }
  }

  // ---- binary ----

  template <bool Swap>
  void read_binary(const PlyElement& element) {
    if (role_ == Role::kVertex && !element.has_list()) {
      read_binary_vertices<Swap>(element);
    } else if (role_ == Role::kSkip && !element.has_list()) {
      skip_bytes(element, element.count * element.least_bytes());
    } else if (role_ == Role::kFace && element.list_count() == 1 &&
               ply_size(property(element, list_).type) == 4) {
      read_binary_triangles<Swap>(element);
    } else {
      read_binary_records<Swap>(element);
    }
  }

  [[noreturn]] void fail_cut_off(const PlyElement& element) {
    source_.fail_at_byte(source_.offset() + source_.available(),
                         "the file ends inside element " + quoted(element.name), kCutOff);
  }
  void need(const PlyElement& element, std::size_t bytes) {
    if (!source_.fill(bytes)) {
      fail_cut_off(element);
    }
  }
  void skip_bytes(const PlyElement& element, std::uint64_t bytes) {
    if (!source_.skip(bytes)) {
      fail_cut_off(element);
    }
  }

  // Records of one size.
  template <bool Swap>
  void read_binary_vertices(const PlyElement& element) {
    const std::size_t stride = element.least_bytes();
    std::size_t at[3];
    PlyType type[3];
    for (int axis = 0; axis < 3; ++axis) {
      at[axis] = element.bytes_before(position_[axis]);
      type[axis] = property(element, position_[axis]).type;
    }
    const bool is_float =
        std::all_of(type, type + 3, [](PlyType t) { return t == PlyType::kFloat32; });
    for (std::uint64_t left = element.count; left > 0;) {
      need(element, stride);
      const std::uint64_t block = std::min<std::uint64_t>(left, source_.available() / stride);
      const char* p = source_.data();
      if (is_float) {
        const auto load = [](const char* q) {
          return static_cast<double>(std::bit_cast<float>(load_word<std::uint32_t, Swap>(q)));
        };
        for (std::uint64_t r = 0; r < block; ++r, p += stride) {
          blocks_.add_vertex(load(p + at[0]), load(p + at[1]), load(p + at[2]));
          add_binary_colour<Swap>(p);
        }
      } else {
        for (std::uint64_t r = 0; r < block; ++r, p += stride) {
          blocks_.add_vertex(load_number<Swap>(type[0], p + at[0]),
                             load_number<Swap>(type[1], p + at[1]),
                             load_number<Swap>(type[2], p + at[2]));
          add_binary_colour<Swap>(p);
        }
      }
      source_.consume(static_cast<std::size_t>(block * stride));
      left -= block;
    }
  }

  // Of the vertex whose record begins at p.
  template <bool Swap>
  void add_binary_colour(const char* p) {
    if (colour_.count() > 0) {
      blocks_.add_colour(colour_.in_record<Swap>(p));
    }
  }

  // One list of 32-bit indices, perhaps among values of fixed size: nearly every file. Triangles
  // take the inner loop, other polygons the general way.
  template <bool Swap>
  void read_binary_triangles(const PlyElement& element) {
    const PlyProperty& list = property(element, list_);
    const std::size_t count_size = ply_size(list.count_type);
    const std::size_t before = element.bytes_before(list_);
    const std::size_t indices = before + count_size;
    const std::size_t record = element.least_bytes() + 3 * sizeof(std::uint32_t);
    const bool is_signed = list.type == PlyType::kInt32 && !wraps(list.type);
    for (std::uint64_t left = element.count; left > 0;) {
      source_.fill(record);
      const char* p = source_.data();
      const char* stop = p + source_.available();
      while (left > 0 && static_cast<std::size_t>(stop - p) >= record &&
             (count_size == 1 ? p[before] == 3
                              : load_integer<Swap>(list.count_type, p + before) == 3)) {
        const std::uint32_t a = load_word<std::uint32_t, Swap>(p + indices);
        const std::uint32_t b = load_word<std::uint32_t, Swap>(p + indices + 4);
        const std::uint32_t c = load_word<std::uint32_t, Swap>(p + indices + 8);
        // Unsigned, so a negative index is beyond any count that signed indices can reach.
        if (std::max({a, b, c}) >= vertices_ ||
            (is_signed && static_cast<std::int32_t>(a | b | c) < 0)) {
          break;
        }
        blocks_.add_triangle(a, b, c);
        p += record;
        --left;
      }
      source_.consume(static_cast<std::size_t>(p - source_.data()));
      if (left > 0) {
        read_binary_record<Swap>(element);
        --left;
      }
    }
  }

  template <bool Swap>
  void read_binary_records(const PlyElement& element) {
    for (std::uint64_t r = 0; r < element.count; ++r) {
      read_binary_record<Swap>(element);
    }
  }

  template <bool Swap>
  void read_binary_record(const PlyElement& element) {
    double p[3] = {};
    double colour[4] = {};
    for (std::size_t k = 0; k < element.properties.size(); ++k) {
      const PlyProperty& prop = element.properties[k];
      const std::size_t size = ply_size(prop.type);
      if (!prop.is_list) {
        need(element, size);
        for (int axis = 0; axis < 3; ++axis) {
          if (role_ == Role::kVertex && position_[axis] == static_cast<int>(k)) {
            p[axis] = load_number<Swap>(prop.type, source_.data());
          }
        }
        if (const int c = colour_.component_of(static_cast<int>(k));
            role_ == Role::kVertex && c >= 0) {
          colour[c] = load_number<Swap>(prop.type, source_.data());
        }
        source_.consume(size);
        continue;
      }
      const std::size_t count_size = ply_size(prop.count_type);
      need(element, count_size);
      const std::int64_t length = load_integer<Swap>(prop.count_type, source_.data());
      if (length < 0) {
        source_.fail_at_byte(source_.offset(), "a list has the length " + std::to_string(length),
                             kRepair);
      }
      source_.consume(count_size);
      if (static_cast<int>(k) == list_) {
        read_binary_face<Swap>(element, prop.type, length);
      } else if (static_cast<std::uint64_t>(length) > kMaxListBytes / size) {
        fail_cut_off(element);
      } else {
        skip_bytes(element, static_cast<std::uint64_t>(length) * size);
      }
    }
    if (role_ == Role::kVertex) {
      blocks_.add_vertex(p[0], p[1], p[2]);
      if (colour_.count() > 0) {
        blocks_.add_colour(colour_.of(colour));
      }
    }
  }

  template <bool Swap>
  void read_binary_face(const PlyElement& element, PlyType type, std::int64_t length) {
    const std::size_t size = ply_size(type);
    begin_face();
    for (; length > 0; --length) {
      need(element, size);
      std::int64_t index = load_integer<Swap>(type, source_.data());
      if (index < -1 && wraps(type)) {
        index &= 0xffffffff;
      }
      if (!add_index(index)) {
        source_.fail_at_byte(source_.offset(), bad_index(index), kRepair);
      }
      source_.consume(size);
    }
    end_face();
  }

  static constexpr std::uint64_t kMaxListBytes = std::uint64_t{1} << 60;
  ByteSource& source_;
  ScanBlocks& blocks_;
  PlyHeader header_;
  std::uint64_t vertices_ = 0;
  Role role_ = Role::kSkip;
  int position_[3] = {};  // of x, y, z among the properties
  int list_ = -1;         // the face's list of vertices among the properties
  Strip strip_;
  PlyColour colour_;
};

}  // namespace

void read_ply(ByteSource& source, ScanBlocks& blocks, ScanFileInfo& info) {
  PlyHeader header = read_ply_header(source);
  static constexpr const char* kNames[] = {"PLY, ASCII", "PLY, binary little endian",
                                           "PLY, binary big endian"};
  info.format = kNames[static_cast<std::size_t>(header.encoding)];
  PlyReader(source, blocks, std::move(header)).read(info);
}

}  // namespace rattan
