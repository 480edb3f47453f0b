// SPDX-License-Identifier: MIT
#include "io/layout/material.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "io/file/atomic_file.h"
#include "io/file/byte_source.h"
#include "io/file/text_numbers.h"
#include "io/scan/scan_blocks.h"

namespace rattan {
namespace {

constexpr const char* kRepair = "Correct the material file";

class MaterialReader {
 public:
  explicit MaterialReader(const std::string& path) : source_(path, std::size_t{1} << 16, info_) {}

  std::vector<Material> read() {
    std::string_view line;
    while (source_.next_line(line)) {
      TextLine words(line);
      const std::string_view keyword = words.word();
      if (keyword == "newmtl") {
        materials_.emplace_back().name = rest_of(line, keyword);
        materials_.back().file = source_.path();
      } else if (keyword == "Kd" || keyword == "map_Kd") {
        if (materials_.empty()) {
          source_.fail_at_line(std::string(keyword) + " comes before the first newmtl", kRepair);
        }
        if (keyword == "Kd") {
          read_colour(words);
        } else {
          read_map(line.substr(static_cast<std::size_t>(keyword.end() - line.begin())));
        }
      }
    }
    return std::move(materials_);
  }

 private:
  static std::string rest_of(std::string_view line, std::string_view keyword) {
    return trimmed(line.substr(static_cast<std::size_t>(keyword.end() - line.begin())));
  }
  static std::string trimmed(std::string_view text) {
    const std::size_t begin = text.find_first_not_of(" \t");
    if (begin == std::string_view::npos) {
      return {};
    }
    return std::string(text.substr(begin, text.find_last_not_of(" \t\r") + 1 - begin));
  }

  void read_colour(TextLine& words) {
    double values[4] = {0.0, 0.0, 0.0, 1.0};
    for (int k = 0; k < 3; ++k) {
      if (!words.number(values[k])) {
        if (k == 1) {  // one number stands for all three
          values[1] = values[2] = values[0];
          break;
        }
        return;  // a spectrum or CIE values, which nobody writes
      }
    }
    Rgb& colour = materials_.back().colour;
    for (std::size_t k = 0; k < 3; ++k) {
      const double v = std::isfinite(values[k]) ? std::clamp(values[k], 0.0, 1.0) : 1.0;
      colour[k] = static_cast<std::uint8_t>(std::lround(255.0 * v));
    }
  }

  // Options, then a name that may have blanks in it.
  void read_map(std::string_view text) {
    Material& m = materials_.back();
    TextLine words(text);
    for (;;) {
      if (words.at_end()) {
        source_.fail_at_line("map_Kd names no picture", kRepair);
      }
      if (words.peek() != '-') {
        break;
      }
      const std::string_view option = words.word();
      if (option == "-o" || option == "-s" || option == "-t") {
        double v[3] = {};
        int count = 0;
        while (count < 3 && words.number(v[count])) {
          ++count;
        }
        if (count == 0) {
          source_.fail_at_line(quoted(option) + " has no number behind it", kRepair);
        }
        if (option == "-s") {
          m.scale = Vec2d(v[0], count > 1 ? v[1] : 1.0);
        } else if (option == "-o") {
          m.offset = Vec2d(v[0], v[1]);
        }
      } else if (option == "-clamp") {
        m.clamped = words.word() == "on";
      } else if (option == "-mm") {
        words.word();
        words.word();
      } else {
        words.word();  // all others have one argument
      }
    }
    const std::string_view first = words.word();
    const std::string name =
        trimmed(text.substr(static_cast<std::size_t>(first.begin() - text.begin())));
    m.picture = beside(source_.path(), name);
  }

  ScanFileInfo info_;
  ByteSource source_;
  std::vector<Material> materials_;
};

}  // namespace

std::vector<Material> read_materials(const std::string& path) {
  return MaterialReader(path).read();
}

std::string beside(const std::string& file, std::string_view name) {
  std::string slashed(name);
  std::replace(slashed.begin(), slashed.end(), '\\', '/');
  return (std::filesystem::path(file).parent_path() / slashed).string();
}

void write_material(const std::string& path, const std::string& name, const std::string& picture) {
  AtomicFile file(path);
  file.write("newmtl " + name + "\nKa 1 1 1\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd " + picture +
             "\n");
  file.commit();
}

}  // namespace rattan
