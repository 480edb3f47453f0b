// SPDX-License-Identifier: MIT
#include "io/scan/scan_outline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fcntl.h>
#include <string_view>
#include <sys/stat.h>
#include <unistd.h>

#include "engine/core/errors.h"
#include "io/file/text_numbers.h"
#include "io/scan/ply_header.h"
#include "io/scan/scan_parsers.h"

namespace rattan {
namespace {

constexpr std::size_t kHeadBytes = 16384;
constexpr std::size_t kTailBytes = 4096;
// Of files of usual models.
constexpr double kObjBytesPerTriangle = 36.0;
constexpr double kStlTextBytesPerTriangle = 250.0;
constexpr double kDracoBytesPerTriangle = 2.5;
constexpr double kPlyBytesPerTriangle = 22.0;
constexpr double kTextRatio = 3.5;  ///< of gzip and Zstandard
constexpr double kBinaryRatio = 1.6;
// No file takes less for a triangle; a header that declares more is wrong.
constexpr double kLeastBytes = 6.0;
constexpr double kLeastPackedBytes = 0.02;

/// What is known of the file around its format.
struct File {
  std::string_view head;
  std::string_view tail;  ///< empty: not at hand
  double content = 0.0;   ///< bytes after decompression, estimated there
  bool compressed = false;
};

void set_counts(ScanOutline& outline, double triangles, double vertices) {
  outline.triangles = triangles;
  outline.vertices = vertices;
  outline.counted = true;
}

void outline_ply(ByteSource& source, ScanOutline& outline) {
  const PlyHeader header = read_ply_header(source);
  const PlyElement* faces = header.find("face");
  const PlyElement* vertices = header.find("vertex");
  if (faces == nullptr || vertices == nullptr) {
    return;
  }
  double corners = 3.0;
  const auto count = static_cast<double>(faces->count);
  const bool plain = header.encoding != PlyEncoding::kAscii && !source.is_compressed() &&
                     header.elements.size() == 2 && !vertices->has_list() &&
                     faces->list_count() == 1 && count > 0.0;
  if (plain) {
    const double rest =
        static_cast<double>(source.content_bytes()) - static_cast<double>(source.offset()) -
        static_cast<double>(vertices->count) * static_cast<double>(vertices->least_bytes());
    const auto list = std::find_if(faces->properties.begin(), faces->properties.end(),
                                   [](const PlyProperty& p) { return p.is_list; });
    corners = (rest / count - static_cast<double>(faces->least_bytes())) /
              static_cast<double>(ply_size(list->type));
  }
  set_counts(outline, count * std::clamp(corners - 2.0, 1.0, 16.0),
             static_cast<double>(vertices->count));
}

void outline_off(ByteSource& source, ScanOutline& outline) {
  std::string_view line;
  for (int lines = 0; lines < 100 && source.next_line(line); ++lines) {
    line = line.substr(0, line.find('#'));
    TextLine words(line);
    if (words.at_end()) {
      continue;
    }
    if (is_off_keyword(line) && line.find_first_of("0123456789") == std::string_view::npos) {
      continue;
    }
    std::int64_t vertices = 0;
    std::int64_t faces = 0;
    const std::size_t digit = line.find_first_of(" \t");
    TextLine counts(is_off_keyword(line) && digit != std::string_view::npos ? line.substr(digit)
                                                                            : line);
    if (counts.integer(vertices) && counts.integer(faces) && vertices >= 0 && faces >= 0) {
      set_counts(outline, static_cast<double>(faces), static_cast<double>(vertices));
    }
    return;
  }
}

std::uint32_t load_u32(const char* p) {
  std::array<unsigned char, 4> b{};
  std::memcpy(b.data(), p, b.size());
  return b[0] | static_cast<std::uint32_t>(b[1]) << 8U | static_cast<std::uint32_t>(b[2]) << 16U |
         static_cast<std::uint32_t>(b[3]) << 24U;
}

double occurrences(std::string_view text, std::string_view word) {
  double n = 0.0;
  for (std::size_t at = text.find(word); at != std::string_view::npos;
       at = text.find(word, at + word.size())) {
    n += 1.0;
  }
  return n;
}

void outline_stl(const ByteSource& source, const File& file, ScanOutline& outline) {
  const std::string_view head = file.head;
  const bool text =
      head.starts_with("solid") && head.substr(0, 512).find('\0') == std::string_view::npos;
  if (!is_binary_stl(source) && text) {
    const double corners = occurrences(head, "vertex");
    const double bytes = corners >= 3.0 ? 3.0 * static_cast<double>(head.size()) / corners
                                        : kStlTextBytesPerTriangle;
    outline.triangles = file.content / bytes;
  } else if (head.size() >= 84) {
    const double declared = load_u32(head.data() + 80);
    const double held = (file.content - 84.0) / 50.0;
    set_counts(outline, file.compressed ? declared : std::clamp(declared, 1.0, held), 0.0);
  }
  outline.vertices = outline.triangles / 2.0;
}

/// Lines of a kind: how many, and how long on average.
struct Lines {
  double count = 0.0;
  double bytes = 0.0;
  double mean(double otherwise) const { return count > 0.0 ? bytes / count : otherwise; }
};

// A closed surface has half as many vertices as triangles, and as many normals and texture
// coordinates if it has any.
void outline_obj(const File& file, ScanOutline& outline) {
  Lines vertex;
  Lines normal;
  Lines texture;
  Lines face;
  double corners = 0.0;
  double slashes = 0.0;
  const auto look = [&](std::string_view text) {
    for (std::size_t end = text.find('\n'); end != std::string_view::npos; end = text.find('\n')) {
      const std::string_view line = text.substr(0, end);
      text.remove_prefix(end + 1);
      Lines* kind = line.starts_with("v ")    ? &vertex
                    : line.starts_with("vn ") ? &normal
                    : line.starts_with("vt ") ? &texture
                    : line.starts_with("f ")  ? &face
                                              : nullptr;
      if (kind == nullptr) {
        continue;
      }
      kind->count += 1.0;
      kind->bytes += static_cast<double>(end + 1);
      if (kind == &face) {
        TextLine words(line.substr(2));
        for (; !words.at_end(); words.word()) {
          corners += 1.0;
        }
        slashes += static_cast<double>(std::count(line.begin(), line.end(), '/'));
      }
    }
  };
  look(file.head);
  if (!file.tail.empty()) {
    const std::size_t first = file.tail.find('\n');
    look(file.tail.substr(first == std::string_view::npos ? file.tail.size() : first + 1));
  }
  if (vertex.count == 0.0 || face.count == 0.0) {
    outline.triangles = file.content / kObjBytesPerTriangle;
  } else {
    const double per_face = corners / face.count;
    const double triangles_of_face = std::max(per_face - 2.0, 1.0);
    const bool textured = slashes > 0.0;
    const bool shaded = slashes > 1.5 * corners;
    const double per_vertex = vertex.mean(28.0) +
                              (textured && texture.count > 0.0 ? texture.mean(20.0) : 0.0) +
                              (normal.count > 0.0 || shaded ? normal.mean(28.0) : 0.0);
    outline.triangles = file.content / (0.5 * per_vertex + face.mean(20.0) / triangles_of_face);
  }
  outline.vertices = outline.triangles / 2.0;
}

bool read_varint(std::string_view& bytes, double& value) {
  std::uint64_t sum = 0;
  for (unsigned shift = 0; shift < 63 && !bytes.empty(); shift += 7) {
    const auto byte = static_cast<unsigned char>(bytes.front());
    bytes.remove_prefix(1);
    sum |= static_cast<std::uint64_t>(byte & 0x7FU) << shift;
    if (byte < 0x80U) {
      value = static_cast<double>(sum);
      return true;
    }
  }
  return false;
}

// After the header come the counts, unless metadata are between.
void outline_draco(const File& file, ScanOutline& outline) {
  outline.whole = true;
  outline.triangles = file.content / kDracoBytesPerTriangle;
  outline.vertices = outline.triangles / 2.0;
  std::string_view head = file.head;
  if (head.size() < 16 || head[5] != 2 || head[6] < 2 || (head[10] & '\x80') != 0) {
    return;
  }
  const bool edgebreaker = head[8] == 1;
  head.remove_prefix(edgebreaker ? 12 : 11);
  double first = 0.0;
  double second = 0.0;
  if (read_varint(head, first) && read_varint(head, second)) {
    set_counts(outline, edgebreaker ? second : first, edgebreaker ? first : second);
  }
}

bool has_suffix(std::string_view path, std::string_view suffix) {
  if (path.size() < suffix.size()) {
    return false;
  }
  return same_word(path.substr(path.size() - suffix.size()), suffix);
}

std::string_view without_packing(std::string_view path) {
  for (const std::string_view packed : {".gz", ".zst"}) {
    if (has_suffix(path, packed)) {
      return path.substr(0, path.size() - packed.size());
    }
  }
  return path;
}

void outline_content(ByteSource& source, File& file, ScanOutline& outline) {
  const std::string_view head = file.head;
  const std::string_view name = without_packing(source.path());
  if (head.starts_with("ply")) {
    outline_ply(source, outline);
    if (!outline.counted) {
      outline.triangles = file.content / kPlyBytesPerTriangle;
    }
  } else if (head.starts_with("DRACO")) {
    outline_draco(file, outline);
  } else if (is_off_keyword(head.substr(0, head.find('\n')))) {
    outline_off(source, outline);
  } else if (has_suffix(name, ".stl") || is_binary_stl(source) || head.starts_with("solid")) {
    outline_stl(source, file, outline);
  } else {
    outline_obj(file, outline);
  }
}

}  // namespace

ScanOutline outline_scan(const std::string& path) {
  ScanOutline outline;
  // A pipe must not be waited for.
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) {
    return outline;
  }
  outline.bytes = static_cast<std::uint64_t>(status.st_size);
  const auto bytes = static_cast<double>(outline.bytes);
  try {
    ScanFileInfo info;
    ByteSource source(path, kHeadBytes, info);
    source.fill(kHeadBytes);
    File file;
    file.head = {source.data(), std::min(source.available(), kHeadBytes)};
    file.compressed = source.is_compressed();
    const bool text = file.head.substr(0, 512).find('\0') == std::string_view::npos;
    file.content = file.compressed ? bytes * (text ? kTextRatio : kBinaryRatio) : bytes;
    std::array<char, kTailBytes> tail{};
    if (!file.compressed && outline.bytes > 2 * kHeadBytes) {
      const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
      const ssize_t got = descriptor < 0
                              ? 0
                              : ::pread(descriptor, tail.data(), tail.size(),
                                        status.st_size - static_cast<off_t>(tail.size()));
      file.tail = {tail.data(), got > 0 ? static_cast<std::size_t>(got) : 0};
      if (descriptor >= 0) {
        ::close(descriptor);
      }
    }
    outline_content(source, file, outline);
  } catch (const Error&) {  // what is wrong with it is said when it is read
    outline.triangles = bytes / kObjBytesPerTriangle;
    outline.counted = false;
  }
  const bool packed = outline.whole || without_packing(path).size() != path.size();
  const double most = bytes / (packed ? kLeastPackedBytes : kLeastBytes) + 1000.0;
  if (!(outline.triangles <= most)) {
    outline.triangles = packed ? bytes / kDracoBytesPerTriangle : bytes / kObjBytesPerTriangle;
    outline.counted = false;
  }
  if (!(outline.vertices <= 3.0 * outline.triangles + 1000.0) || outline.vertices == 0.0) {
    outline.vertices = outline.triangles / 2.0;
  }
  return outline;
}

}  // namespace rattan
