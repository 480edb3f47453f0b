// SPDX-License-Identifier: MIT
#include <algorithm>
#include <charconv>
#include <limits>
#include <vector>

#include "engine/core/errors.h"
#include "io/remesh/polygon_files.h"

namespace rattan {
namespace {

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

/// Words and lines of a text in memory.
class TextCursor {
 public:
  TextCursor(std::string_view text, const std::string& path, std::size_t first_line = 1)
      : at_(text.data()), end_(text.data() + text.size()), path_(path), line_(first_line) {}

  bool at_end() const { return at_ == end_; }
  const char* position() const { return at_; }

  /// Skips blanks; true if the line has nothing more. A backslash before the line break joins
  /// lines.
  bool line_ends() {
    for (;;) {
      while (at_ != end_ && is_blank(*at_)) {
        ++at_;
      }
      if (at_ != end_ && *at_ == '\\' && end_ - at_ > 1 &&
          (at_[1] == '\n' || (at_[1] == '\r' && end_ - at_ > 2 && at_[2] == '\n'))) {
        at_ += at_[1] == '\n' ? 2 : 3;
        ++line_;
        continue;
      }
      return at_ == end_ || *at_ == '\n';
    }
  }
  /// Empty at the end of the line.
  std::string_view word() {
    if (line_ends()) {
      return {};
    }
    const char* begin = at_;
    while (at_ != end_ && !is_blank(*at_) && *at_ != '\n') {
      ++at_;
    }
    return {begin, static_cast<std::size_t>(at_ - begin)};
  }
  void next_line() {
    while (at_ != end_ && *at_ != '\n') {
      ++at_;
    }
    if (at_ != end_) {
      ++at_;
      ++line_;
    }
  }
  /// To the next word, over line breaks and `#` comments.
  std::string_view word_anywhere() {
    for (;;) {
      if (!line_ends()) {
        if (*at_ != '#') {
          return word();
        }
      } else if (at_ == end_) {
        return {};
      }
      next_line();
    }
  }

  template <class Number>
  Number number(std::string_view text, const char* what) const {
    if (!text.empty() && text.front() == '+') {
      text.remove_prefix(1);
    }
    Number value{};
    const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || result.ec == std::errc::invalid_argument ||
        result.ptr != text.data() + text.size()) {
      fail(std::string("expected ") + what +
           (text.empty() ? " but the line ends"
                         : ", found '" + std::string(text.substr(0, 40)) + "'"));
    }
    if (result.ec != std::errc()) {
      fail(std::string(what) + " out of range: '" + std::string(text.substr(0, 40)) + "'");
    }
    return value;
  }
  Vec3d point(bool anywhere) {
    Vec3d p;
    for (int k = 0; k < 3; ++k) {
      p[k] = number<double>(anywhere && k == 0 ? word_anywhere() : word(), "a coordinate");
    }
    return p;
  }
  [[noreturn]] void fail(const std::string& problem) const {
    throw InputError(path_, "line " + std::to_string(line_), problem,
                     "Repair the file or export it again");
  }

 private:
  const char* at_;
  const char* end_;
  const std::string& path_;
  std::size_t line_;
};

/// From 0 to 1, or, as whole numbers, to 255.
std::uint8_t channel(double value, bool whole) {
  const double v = whole ? value : 255.0 * value;
  return static_cast<std::uint8_t>(v > 0.0 ? std::min(v + 0.5, 255.0) : 0.0);
}

/// The colour of the vertex just added.
void add_colour(const Rgba& colour, PolygonMesh& mesh) {
  mesh.colours.resize(mesh.vertex_count() - 1, Rgba{255, 255, 255, 255});
  mesh.colours.push_back(colour);
}

/// Vertices after the last one with a colour are white too.
void pad_colours(PolygonMesh& mesh) {
  if (!mesh.colours.empty()) {
    mesh.colours.resize(mesh.vertex_count(), Rgba{255, 255, 255, 255});
  }
}

/// Three or four numbers that end a line, after `skip` others. Whole numbers go to 255 if
/// `whole_numbers` says so or one is above 1; else white is 1.
void read_colour(TextCursor& text, std::size_t skip, bool whole_numbers, PolygonMesh& mesh) {
  double values[8];
  std::size_t count = 0;
  bool whole = true;
  while (count < std::size(values) && !text.line_ends()) {
    const std::string_view word = text.word();
    if (word.front() == '#') {
      break;
    }
    const auto end = word.data() + word.size();
    const auto result = std::from_chars(word.data(), end, values[count]);
    if (result.ec != std::errc() || result.ptr != end) {
      return;
    }
    whole = whole && word.find('.') == std::string_view::npos && values[count] >= 0.0;
    ++count;
  }
  if (count != skip + 3 && count != skip + 4) {
    return;
  }
  double most = 0.0;
  for (std::size_t c = skip; c < count; ++c) {
    most = std::max(most, values[c]);
  }
  Rgba colour{255, 255, 255, 255};
  for (std::size_t c = skip; c < count; ++c) {
    colour[c - skip] = channel(values[c], whole && (whole_numbers || most > 1.0));
  }
  add_colour(colour, mesh);
}

void check_face(const std::vector<std::uint32_t>& face, const std::string& path, std::size_t f) {
  if (face.size() < 3) {
    throw InputError(path, "face " + std::to_string(f),
                     "it has " + std::to_string(face.size()) + " corners",
                     "A face needs three or more");
  }
}

/// After reading: every corner names a vertex.
void check_corners(const PolygonMesh& mesh, const std::string& path) {
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    for (const std::uint32_t v : mesh.face(f)) {
      if (v >= mesh.vertex_count()) {
        throw InputError(
            path, "face " + std::to_string(f),
            "it names vertex " + std::to_string(v) + " of " + std::to_string(mesh.vertex_count()),
            "Repair the file or export it again");
      }
    }
  }
}

constexpr std::int64_t kMostVertices = std::numeric_limits<std::uint32_t>::max() - 1;

// ---- PLY ----

enum class Type { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

struct Property {
  std::string name;
  bool list = false;
  Type count = Type::kUint8;
  Type value = Type::kFloat;
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

std::size_t size_of(Type type) {
  constexpr std::size_t kSizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

Type type_of(std::string_view name, const TextCursor& text) {
  constexpr std::string_view kNames[][2] = {
      {"char", "int8"}, {"uchar", "uint8"}, {"short", "int16"},   {"ushort", "uint16"},
      {"int", "int32"}, {"uint", "uint32"}, {"float", "float32"}, {"double", "float64"}};
  for (std::size_t i = 0; i < std::size(kNames); ++i) {
    if (name == kNames[i][0] || name == kNames[i][1]) {
      return static_cast<Type>(i);
    }
  }
  text.fail("unknown property type '" + std::string(name.substr(0, 40)) + "'");
}

/// One value after another from the body of a PLY file.
class PlyBody {
 public:
  PlyBody(std::string_view body, bool ascii, bool swap, const std::string& path,
          std::size_t first_byte, std::size_t first_line)
      : text_(body, path, first_line),
        body_(body),
        path_(path),
        first_byte_(first_byte),
        ascii_(ascii),
        swap_(swap) {}

  double value(Type type) {
    if (ascii_) {
      return text_.number<double>(text_.word_anywhere(), "a number");
    }
    const std::size_t size = size_of(type);
    if (body_.size() - at_ < size) {
      throw InputError(path_, "byte " + std::to_string(first_byte_ + body_.size()),
                       "the file ends too early", "Copy or export it again");
    }
    char raw[8];
    for (std::size_t i = 0; i < size; ++i) {
      raw[i] = body_[at_ + (swap_ ? size - 1 - i : i)];
    }
    at_ += size;
    switch (type) {
      case Type::kInt8:
        return as<std::int8_t>(raw);
      case Type::kUint8:
        return as<std::uint8_t>(raw);
      case Type::kInt16:
        return as<std::int16_t>(raw);
      case Type::kUint16:
        return as<std::uint16_t>(raw);
      case Type::kInt32:
        return as<std::int32_t>(raw);
      case Type::kUint32:
        return as<std::uint32_t>(raw);
      case Type::kFloat:
        return static_cast<double>(as<float>(raw));
      case Type::kDouble:
        break;
    }
    return as<double>(raw);
  }
  /// A whole number from 0 to `most`.
  std::uint64_t whole(Type type, double most, const char* what) {
    const double v = value(type);
    if (!(v >= 0.0 && v <= most) || v != static_cast<double>(static_cast<std::uint64_t>(v))) {
      const std::string place = ascii_ ? "" : "byte " + std::to_string(first_byte_ + at_);
      throw InputError(path_, place, std::string(what) + " out of range",
                       "Repair the file or export it again");
    }
    return static_cast<std::uint64_t>(v);
  }
  std::size_t bytes_left() const {
    return ascii_ ? body_.size() - static_cast<std::size_t>(text_.position() - body_.data())
                  : body_.size() - at_;
  }

 private:
  template <class T>
  static T as(const char* raw) {
    T v;
    std::copy(raw, raw + sizeof(T), reinterpret_cast<char*>(&v));
    return v;
  }

  TextCursor text_;
  std::string_view body_;
  const std::string& path_;
  std::size_t first_byte_;
  std::size_t at_ = 0;
  bool ascii_;
  bool swap_;
};

void read_element(const Element& element, PlyBody& body, const std::string& path,
                  PolygonMesh& mesh) {
  int axis_of[3] = {-1, -1, -1};
  int channel_of[4] = {-1, -1, -1, -1};
  int indices = -1;
  for (int p = 0; p < static_cast<int>(element.properties.size()); ++p) {
    const Property& property = element.properties[static_cast<std::size_t>(p)];
    for (int k = 0; k < 3; ++k) {
      if (element.name == "vertex" && !property.list && property.name == std::string(1, "xyz"[k])) {
        axis_of[k] = p;
      }
    }
    constexpr std::string_view kChannels[] = {"red", "green", "blue", "alpha"};
    for (int c = 0; c < 4; ++c) {
      if (element.name == "vertex" && !property.list && property.name == kChannels[c]) {
        channel_of[c] = p;
      }
    }
    if (element.name == "face" && property.list &&
        (property.name == "vertex_indices" || property.name == "vertex_index")) {
      indices = p;
    }
  }
  const bool is_vertex = element.name == "vertex";
  if (is_vertex && (axis_of[0] < 0 || axis_of[1] < 0 || axis_of[2] < 0)) {
    throw InputError(path, "header", "vertices lack x, y or z", "Export the mesh with positions");
  }
  const bool has_colour = channel_of[0] >= 0 && channel_of[1] >= 0 && channel_of[2] >= 0;
  std::vector<std::uint32_t> face;
  for (std::uint64_t i = 0; i < element.count; ++i) {
    Vec3d point = Vec3d::Zero();
    Rgba colour{255, 255, 255, 255};
    for (int p = 0; p < static_cast<int>(element.properties.size()); ++p) {
      const Property& property = element.properties[static_cast<std::size_t>(p)];
      if (!property.list) {
        const double v = body.value(property.value);
        for (int k = 0; k < 3; ++k) {
          if (axis_of[k] == p) {
            point[k] = v;
          }
        }
        for (std::size_t c = 0; c < 4; ++c) {
          if (channel_of[c] == p) {
            const bool whole = property.value != Type::kFloat && property.value != Type::kDouble;
            colour[c] = channel(v, whole);
          }
        }
        continue;
      }
      const std::uint64_t count =
          body.whole(property.count, static_cast<double>(body.bytes_left()), "a list's length");
      face.clear();
      for (std::uint64_t j = 0; j < count; ++j) {
        if (p == indices) {
          face.push_back(static_cast<std::uint32_t>(
              body.whole(property.value, static_cast<double>(kMostVertices), "a vertex index")));
        } else {
          body.value(property.value);
        }
      }
      if (p == indices) {
        check_face(face, path, i);
        mesh.add_face(face);
      }
    }
    if (is_vertex) {
      mesh.positions.push_back(point);
      if (has_colour) {
        add_colour(colour, mesh);
      }
    }
  }
}

}  // namespace

PolygonMesh parse_obj(std::string_view bytes, const std::string& path) {
  PolygonMesh mesh;
  TextCursor text(bytes, path);
  std::vector<std::uint32_t> face;
  for (; !text.at_end(); text.next_line()) {
    const std::string_view kind = text.word();
    if (kind == "v") {
      mesh.positions.push_back(text.point(false));
      read_colour(text, 0, false, mesh);
    } else if (kind == "f") {
      face.clear();
      while (!text.line_ends()) {
        std::string_view corner = text.word();
        if (corner.front() == '#') {
          break;
        }
        corner = corner.substr(0, corner.find('/'));
        const auto index = text.number<std::int64_t>(corner, "a vertex number");
        const auto count = static_cast<std::int64_t>(mesh.vertex_count());
        const std::int64_t v = index < 0 ? count + index : index - 1;
        if (v < 0 || v >= kMostVertices) {
          text.fail("vertex number " + std::to_string(index) + " is out of range");
        }
        face.push_back(static_cast<std::uint32_t>(v));
      }
      if (face.size() < 3) {
        text.fail("a face of " + std::to_string(face.size()) + " corners");
      }
      mesh.add_face(face);
    }
  }
  pad_colours(mesh);
  check_corners(mesh, path);
  return mesh;
}

PolygonMesh parse_off(std::string_view bytes, const std::string& path) {
  PolygonMesh mesh;
  TextCursor text(bytes, path);
  const std::string_view magic = text.word_anywhere();
  if (magic != "OFF" && magic != "COFF" && magic != "NOFF" && magic != "CNOFF") {
    text.fail("this is no ASCII OFF file");
  }
  const auto vertices = text.number<std::uint64_t>(text.word_anywhere(), "the number of vertices");
  const auto faces = text.number<std::uint64_t>(text.word_anywhere(), "the number of faces");
  text.next_line();
  for (std::uint64_t v = 0; v < vertices; ++v) {
    mesh.positions.push_back(text.point(true));
    if (magic.front() == 'C') {
      read_colour(text, magic[1] == 'N' ? 3 : 0, true, mesh);
    }
    text.next_line();
  }
  pad_colours(mesh);
  std::vector<std::uint32_t> face;
  for (std::uint64_t f = 0; f < faces; ++f) {
    const auto degree = text.number<std::uint64_t>(text.word_anywhere(), "a number of corners");
    face.clear();
    for (std::uint64_t i = 0; i < degree; ++i) {
      face.push_back(text.number<std::uint32_t>(text.word(), "a vertex number"));
    }
    check_face(face, path, f);
    mesh.add_face(face);
    text.next_line();
  }
  check_corners(mesh, path);
  return mesh;
}

PolygonMesh parse_ply(std::string_view bytes, const std::string& path) {
  TextCursor text(bytes, path);
  if (text.word() != "ply") {
    text.fail("this is no PLY file");
  }
  std::vector<Element> elements;
  bool ascii = false;
  bool swap = false;
  std::size_t lines = 1;
  for (bool header = true; header;) {
    text.next_line();
    ++lines;
    if (text.at_end()) {
      text.fail("the header does not end");
    }
    const std::string_view kind = text.word();
    if (kind == "format") {
      const std::string_view format = text.word();
      ascii = format == "ascii";
      swap = format == "binary_big_endian";
      if (!ascii && !swap && format != "binary_little_endian") {
        text.fail("unknown format '" + std::string(format.substr(0, 40)) + "'");
      }
    } else if (kind == "element") {
      Element element;
      element.name = text.word();
      element.count = text.number<std::uint64_t>(text.word(), "the number of elements");
      elements.push_back(element);
    } else if (kind == "property") {
      if (elements.empty()) {
        text.fail("a property before any element");
      }
      Property property;
      std::string_view type = text.word();
      if (type == "list") {
        property.list = true;
        property.count = type_of(text.word(), text);
        type = text.word();
      }
      property.value = type_of(type, text);
      property.name = text.word();
      elements.back().properties.push_back(property);
    } else if (kind == "end_header") {
      header = false;
    } else if (kind != "comment" && kind != "obj_info" && !kind.empty()) {
      text.fail("unknown header line '" + std::string(kind.substr(0, 40)) + "'");
    }
  }
  text.next_line();
  const auto begin = static_cast<std::size_t>(text.position() - bytes.data());
  PolygonMesh mesh;
  PlyBody body(bytes.substr(begin), ascii, swap, path, begin, lines + 1);
  for (const Element& element : elements) {
    if (element.properties.empty()) {
      continue;
    }
    read_element(element, body, path, mesh);
  }
  check_corners(mesh, path);
  return mesh;
}

}  // namespace rattan
