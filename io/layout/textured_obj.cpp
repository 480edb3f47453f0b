// SPDX-License-Identifier: MIT
#include <algorithm>
#include <filesystem>
#include <map>
#include <system_error>
#include <utility>

#include "io/file/byte_source.h"
#include "io/file/text_numbers.h"
#include "io/layout/textured_faces.h"
#include "io/scan/obj_statements.h"
#include "io/scan/scan_blocks.h"

namespace rattan {
namespace {

constexpr const char* kRepair = "Export the scan again or correct the line";

class TexturedObjReader {
 public:
  TexturedObjReader(const std::string& path, TexturedFaceSink& sink)
      : source_(path, std::size_t{1} << 20, info_), sink_(sink) {}

  std::vector<Material> read() {
    std::string_view line;
    while (statements_.next(line)) {
      TextLine words(line);
      const std::string_view keyword = words.word();
      if (keyword == "v") {
        double p[3] = {};
        numbers(words, p, 3, 3);
        sink_.add_vertex(Vec3d(p[0], p[1], p[2]));
        ++vertices_;
      } else if (keyword == "vt") {
        double t[2] = {};
        numbers(words, t, 1, 2);
        sink_.add_texture_vertex(t[0], t[1]);
        ++texture_vertices_;
      } else if (keyword == "f" || keyword == "fo") {
        read_face(words);
      } else if (keyword == "usemtl") {
        use(rest_of(line, keyword));
      } else if (keyword == "mtllib") {
        read_libraries(rest_of(line, keyword));
      }
    }
    return std::move(used_);
  }

 private:
  static std::string_view rest_of(std::string_view line, std::string_view keyword) {
    line.remove_prefix(static_cast<std::size_t>(keyword.end() - line.begin()));
    const std::size_t begin = line.find_first_not_of(" \t");
    return begin == std::string_view::npos
               ? std::string_view()
               : line.substr(begin, line.find_last_not_of(" \t\r") + 1 - begin);
  }

  void numbers(TextLine& words, double* values, int least, int most) {
    for (int k = 0; k < most; ++k) {
      if (!words.number(values[k])) {
        if (k < least) {
          source_.fail_at_line("a number is missing", kRepair);
        }
        return;
      }
    }
  }

  void read_face(TextLine& words) {
    std::uint64_t corners = 0;
    std::array<std::uint64_t, 3> vertex{};
    std::array<std::uint64_t, 3> texture{};
    while (!words.at_end() && words.peek() != '#') {
      const std::string_view word = words.word();
      const std::size_t slash = std::min(word.find('/'), word.size());
      const std::string_view behind = word.substr(std::min(slash + 1, word.size()));
      const std::string_view second = behind.substr(0, std::min(behind.find('/'), behind.size()));
      const std::size_t k = std::min<std::uint64_t>(corners, 2);
      if (corners > 2) {
        vertex[1] = vertex[2];
        texture[1] = texture[2];
      }
      vertex[k] = index_of(word.substr(0, slash), vertices_, "vertex");
      texture[k] =
          second.empty() ? kNoTexture : index_of(second, texture_vertices_, "texture vertex");
      if (++corners >= 3) {
        sink_.add_triangle(vertex, texture, current_);
      }
    }
  }

  std::uint64_t index_of(std::string_view word, std::uint64_t count, const char* what) {
    std::int64_t index = 0;
    TextLine line(word);
    const bool is_number = line.integer(index) && index != 0;
    if (is_number && index > 0) {
      return static_cast<std::uint64_t>(index) - 1;
    }
    const std::uint64_t back = ~static_cast<std::uint64_t>(index) + 1;
    if (!is_number || back > count) {
      source_.fail_at_line(quoted(word) + " is no " + what + " of a face", kRepair);
    }
    return count - back;
  }

  // Materials are numbered as they are used, whether they are known already or not.
  void use(std::string_view name) {
    const auto [at, is_new] =
        number_.try_emplace(std::string(name), static_cast<std::uint32_t>(used_.size()));
    current_ = at->second;
    if (is_new) {
      used_.emplace_back().name = name;
      const auto known = library_.find(at->first);
      if (known != library_.end()) {
        used_.back() = known->second;
      }
    }
  }

  // One name with blanks in it, or several between blanks.
  void read_libraries(std::string_view names) {
    const std::string whole = beside(source_.path(), names);
    std::error_code unknown;
    if (!names.empty() && std::filesystem::exists(whole, unknown)) {
      read_library(whole);
      return;
    }
    TextLine words(names);
    while (!words.at_end()) {
      read_library(beside(source_.path(), words.word()));
    }
  }
  void read_library(const std::string& path) {
    for (Material& m : read_materials(path)) {
      const auto used = number_.find(m.name);
      if (used != number_.end()) {
        used_[used->second] = m;
      }
      library_.insert_or_assign(m.name, std::move(m));
    }
  }

  ScanFileInfo info_;
  ByteSource source_;
  TexturedFaceSink& sink_;
  ObjStatements statements_{source_, kRepair};
  std::uint64_t vertices_ = 0;
  std::uint64_t texture_vertices_ = 0;
  std::uint32_t current_ = kNoMaterial;
  std::vector<Material> used_;
  std::map<std::string, std::uint32_t> number_;  // of those used
  std::map<std::string, Material> library_;
};

}  // namespace

std::vector<Material> read_textured_obj(const std::string& scan, TexturedFaceSink& sink) {
  return TexturedObjReader(scan, sink).read();
}

}  // namespace rattan
