// SPDX-License-Identifier: MIT
#include <bit>
#include <cmath>
#include <string_view>

#include "io/file/byte_source.h"
#include "io/file/text_numbers.h"
#include "io/layout/textured_faces.h"
#include "io/scan/ply_header.h"
#include "io/scan/ply_values.h"

namespace rattan {
namespace {

constexpr const char* kRepair = "Export the scan again or correct the file";

/// The pictures that the header's comments name.
std::vector<Material> materials_of(const std::string& path) {
  ScanFileInfo info;
  ByteSource source(path, 4096, info);
  std::vector<Material> materials;
  std::string_view line;
  while (source.next_line(line)) {
    TextLine words(line);
    const std::string_view keyword = words.word();
    if (keyword == "end_header") {
      break;
    }
    if (keyword != "comment" || words.word() != "TextureFile" || words.at_end()) {
      continue;
    }
    const std::string_view name = words.word();
    line.remove_prefix(static_cast<std::size_t>(name.begin() - line.begin()));
    Material& m = materials.emplace_back();
    m.name = line.substr(0, line.find_last_not_of(" \t\r") + 1);
    m.picture = beside(path, m.name);
  }
  return materials;
}

/// Reads any record as numbers: slower than the reader of scans, which knows what it may skip.
class TexturedPlyReader {
 public:
  TexturedPlyReader(const std::string& path, std::uint64_t materials, TexturedFaceSink& sink)
      : source_(path, std::size_t{1} << 20, info_), materials_(materials), sink_(sink) {}

  void read() {
    const PlyHeader header = read_ply_header(source_);
    for (const PlyElement& element : header.elements) {
      values_.resize(std::max(values_.size(), element.properties.size()));
      find_properties(element);
      for (std::uint64_t r = 0; r < element.count && !element.properties.empty(); ++r) {
        if (header.encoding == PlyEncoding::kAscii) {
          read_text(element);
        } else if ((header.encoding == PlyEncoding::kLittleEndian) ==
                   (std::endian::native == std::endian::little)) {
          read_binary<false>(element);
        } else {
          read_binary<true>(element);
        }
        if (is_vertex_) {
          take_vertex();
        } else if (list_ >= 0) {
          take_face();
        }
      }
    }
  }

 private:
  void find_properties(const PlyElement& element) {
    is_vertex_ = element.name == "vertex";
    list_ = texture_list_ = texture_number_ = -1;
    if (is_vertex_) {
      static constexpr const char* kAxis[] = {"x", "y", "z"};
      for (std::size_t k = 0; k < 3; ++k) {
        position_[k] = element.find(kAxis[k]);
      }
      is_vertex_ = position_[0] >= 0 && position_[1] >= 0 && position_[2] >= 0;
      static constexpr const char* kTexture[][2] = {
          {"texture_u", "texture_v"}, {"s", "t"}, {"u", "v"}};
      for (const auto& names : kTexture) {
        const int u = element.find(names[0]);
        const int v = element.find(names[1]);
        if (u >= 0 && v >= 0) {
          texture_ = {u, v};
          break;
        }
      }
    } else if (element.name == "face") {
      list_ = element.find("vertex_indices");
      list_ = list_ >= 0 ? list_ : element.find("vertex_index");
      texture_list_ = element.find("texcoord");
      texture_number_ = element.find("texnumber");
    }
  }

  void take_vertex() {
    const auto value = [&](int k) {
      const auto& list = values_[static_cast<std::size_t>(k)];
      return list.empty() ? 0.0 : list[0];
    };
    sink_.add_vertex(Vec3d(value(position_[0]), value(position_[1]), value(position_[2])));
    if (texture_[0] >= 0) {
      sink_.add_texture_vertex(value(texture_[0]), value(texture_[1]));
      ++texture_vertices_;
    }
  }

  void take_face() {
    const std::vector<double>& corners = values_[static_cast<std::size_t>(list_)];
    const std::size_t n = corners.size();
    const bool by_face =
        texture_list_ >= 0 && values_[static_cast<std::size_t>(texture_list_)].size() == 2 * n;
    const std::uint64_t first = texture_vertices_;
    if (by_face) {
      const std::vector<double>& t = values_[static_cast<std::size_t>(texture_list_)];
      for (std::size_t k = 0; k < n; ++k) {
        sink_.add_texture_vertex(t[2 * k], t[2 * k + 1]);
      }
      texture_vertices_ += n;
    }
    std::uint32_t material = 0;
    if (texture_number_ >= 0) {
      const auto& number = values_[static_cast<std::size_t>(texture_number_)];
      const double m = number.empty() ? 0.0 : number[0];
      material = m >= 0.0 && m < static_cast<double>(materials_) ? static_cast<std::uint32_t>(m)
                                                                 : kNoMaterial;
    }
    const auto vertex = [&](std::size_t k) {
      if (!(corners[k] >= 0.0 && corners[k] < 0x1p53)) {
        source_.fail_at_byte(source_.offset(), "a face refers to a vertex that cannot be", kRepair);
      }
      return static_cast<std::uint64_t>(corners[k]);
    };
    const auto texture = [&](std::size_t k) {
      return by_face ? first + k : texture_[0] >= 0 ? vertex(k) : kNoTexture;
    };
    for (std::size_t k = 2; k < n; ++k) {
      sink_.add_triangle({vertex(0), vertex(k - 1), vertex(k)},
                         {texture(0), texture(k - 1), texture(k)}, material);
    }
  }

  void read_text(const PlyElement& element) {
    std::string_view line;
    do {
      if (!source_.next_line(line)) {
        source_.fail_at_line("the file ends inside element " + quoted(element.name), kRepair);
      }
    } while (TextLine(line).at_end());
    TextLine words(line);
    for (std::size_t k = 0; k < element.properties.size(); ++k) {
      std::int64_t count = 1;
      if (element.properties[k].is_list && (!words.integer(count) || count < 0)) {
        source_.fail_at_line("a list has no length", kRepair);
      }
      values_[k].clear();
      for (double value = 0.0; count > 0; --count) {
        if (!words.number(value)) {
          source_.fail_at_line("a number is missing", kRepair);
        }
        values_[k].push_back(value);
      }
    }
  }

  template <bool Swap>
  void read_binary(const PlyElement& element) {
    for (std::size_t k = 0; k < element.properties.size(); ++k) {
      const PlyProperty& property = element.properties[k];
      std::int64_t count = 1;
      if (property.is_list) {
        need(ply_size(property.count_type));
        count = load_integer<Swap>(property.count_type, source_.data());
        source_.consume(ply_size(property.count_type));
      }
      values_[k].clear();
      const std::size_t size = ply_size(property.type);
      for (; count > 0; --count) {
        need(size);
        values_[k].push_back(load_number<Swap>(property.type, source_.data()));
        source_.consume(size);
      }
    }
  }
  void need(std::size_t bytes) {
    if (!source_.fill(bytes)) {
      source_.fail_at_byte(source_.offset(), "the file ends too early", kRepair);
    }
  }

  ScanFileInfo info_;
  ByteSource source_;
  const std::uint64_t materials_;
  TexturedFaceSink& sink_;
  std::vector<std::vector<double>> values_;  // of one record, by property
  bool is_vertex_ = false;
  std::array<int, 3> position_{-1, -1, -1};
  std::array<int, 2> texture_{-1, -1};
  int list_ = -1;
  int texture_list_ = -1;
  int texture_number_ = -1;
  std::uint64_t texture_vertices_ = 0;
};

}  // namespace

std::vector<Material> read_textured_ply(const std::string& scan, TexturedFaceSink& sink,
                                        bool pictures_only) {
  std::vector<Material> materials = materials_of(scan);
  if (!materials.empty() || !pictures_only) {
    TexturedPlyReader(scan, materials.size(), sink).read();
  }
  return materials;
}

}  // namespace rattan
