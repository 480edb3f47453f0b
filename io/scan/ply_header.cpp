// SPDX-License-Identifier: MIT
#include "io/scan/ply_header.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "io/file/text_numbers.h"

namespace rattan {
namespace {

constexpr const char* kRepair = "Correct the header or export the scan again";
// Generous; a file beyond them is not a scan.
constexpr std::size_t kMaxElements = 256;
constexpr std::size_t kMaxProperties = 4096;
constexpr std::uint64_t kMaxCount = std::uint64_t{1} << 48;

std::optional<PlyType> type_of(std::string_view word) {
  static constexpr std::pair<std::string_view, PlyType> kNames[] = {
      {"char", PlyType::kInt8},       {"int8", PlyType::kInt8},       {"uchar", PlyType::kUint8},
      {"uint8", PlyType::kUint8},     {"short", PlyType::kInt16},     {"int16", PlyType::kInt16},
      {"ushort", PlyType::kUint16},   {"uint16", PlyType::kUint16},   {"int", PlyType::kInt32},
      {"int32", PlyType::kInt32},     {"uint", PlyType::kUint32},     {"uint32", PlyType::kUint32},
      {"float", PlyType::kFloat32},   {"float32", PlyType::kFloat32}, {"double", PlyType::kFloat64},
      {"float64", PlyType::kFloat64}, {"int64", PlyType::kInt64},     {"uint64", PlyType::kUint64},
  };
  for (const auto& [name, type] : kNames) {
    if (name == word) {
      return type;
    }
  }
  return std::nullopt;
}

class HeaderReader {
 public:
  explicit HeaderReader(ByteSource& source) : source_(source) {}

  PlyHeader read() {
    std::string_view line;
    source_.next_line(line);
    if (line.find('\r') != std::string_view::npos) {
      source_.fail_at_line("the header's lines end in carriage returns alone",
                           "Convert the line ends of the header to line feeds");
    }
    if (TextLine(line).word() != "ply") {
      source_.fail_at_line("the file does not start with \"ply\"",
                           "Check that this is a PLY file and complete");
    }
    bool has_format = false;
    for (;;) {
      if (!source_.next_line(line)) {
        source_.fail_at_line("the file ends inside its header",
                             "It is cut off; copy or export it again");
      }
      TextLine words(line);
      const std::string_view keyword = words.word();
      if (keyword.empty() || keyword == "comment" || keyword == "obj_info") {
        continue;
      }
      if (keyword == "end_header") {
        break;
      }
      if (keyword == "format") {
        read_format(words);
        has_format = true;
      } else if (keyword == "element") {
        read_element(words);
      } else if (keyword == "property") {
        read_property(words);
      } else {
        source_.fail_at_line(quoted(keyword) + " is not a statement of a PLY header", kRepair);
      }
    }
    if (!has_format) {
      source_.fail_at_line("the header has no \"format\"", kRepair);
    }
    return std::move(header_);
  }

 private:
  void read_format(TextLine& words) {
    const std::string_view word = words.word();
    if (word == "ascii") {
      header_.encoding = PlyEncoding::kAscii;
    } else if (word == "binary_little_endian") {
      header_.encoding = PlyEncoding::kLittleEndian;
    } else if (word == "binary_big_endian") {
      header_.encoding = PlyEncoding::kBigEndian;
    } else {
      source_.fail_at_line("unknown PLY format " + quoted(word),
                           "Use ascii, binary_little_endian or binary_big_endian");
    }
  }

  void read_element(TextLine& words) {
    PlyElement element;
    element.name = words.word();
    std::int64_t count = 0;
    const bool is_number = words.integer(count);
    if (element.name.empty() || !is_number || count < 0 ||
        static_cast<std::uint64_t>(count) > kMaxCount) {
      source_.fail_at_line("the count of element " + quoted(element.name) + " is " +
                               (is_number ? std::to_string(count) : quoted(words.word())),
                           kRepair);
    }
    if (header_.find(element.name) != nullptr || header_.elements.size() >= kMaxElements) {
      source_.fail_at_line(
          "element " + quoted(element.name) + " is declared twice or is one of " + "too many",
          kRepair);
    }
    element.count = static_cast<std::uint64_t>(count);
    header_.elements.push_back(std::move(element));
  }

  void read_property(TextLine& words) {
    if (header_.elements.empty()) {
      source_.fail_at_line("a property comes before the first element", kRepair);
    }
    PlyElement& element = header_.elements.back();
    PlyProperty property;
    std::string_view type = words.word();
    property.is_list = type == "list";
    if (property.is_list) {
      property.count_type = expect_type(words.word());
      if (!ply_is_integer(property.count_type)) {
        source_.fail_at_line("the length of a list is not an integer type", kRepair);
      }
      type = words.word();
    }
    property.type = expect_type(type);
    property.name = words.word();
    if (property.name.empty() || element.find(property.name) >= 0 ||
        element.properties.size() >= kMaxProperties) {
      source_.fail_at_line("property " + quoted(property.name) + " has no name, is declared " +
                               "twice, or is one of too many",
                           kRepair);
    }
    element.properties.push_back(std::move(property));
  }

  PlyType expect_type(std::string_view word) const {
    const std::optional<PlyType> type = type_of(word);
    if (!type) {
      source_.fail_at_line(quoted(word) + " is not a PLY type", kRepair);
    }
    return *type;
  }

  ByteSource& source_;
  PlyHeader header_;
};

}  // namespace

std::size_t ply_size(PlyType type) {
  static constexpr std::size_t kSize[] = {1, 1, 2, 2, 4, 4, 4, 8, 8, 8};
  return kSize[static_cast<std::size_t>(type)];
}

std::size_t PlyElement::list_count() const {
  return static_cast<std::size_t>(std::count_if(properties.begin(), properties.end(),
                                                [](const PlyProperty& p) { return p.is_list; }));
}

std::uint64_t PlyElement::bytes_before(int k) const {
  std::uint64_t bytes = 0;
  for (int i = 0; i < k; ++i) {
    const PlyProperty& p = properties[static_cast<std::size_t>(i)];
    bytes += ply_size(p.is_list ? p.count_type : p.type);
  }
  return bytes;
}

int PlyElement::find(std::string_view property) const {
  for (std::size_t k = 0; k < properties.size(); ++k) {
    if (properties[k].name == property) {
      return static_cast<int>(k);
    }
  }
  return -1;
}

const PlyElement* PlyHeader::find(std::string_view element) const {
  for (const PlyElement& e : elements) {
    if (e.name == element) {
      return &e;
    }
  }
  return nullptr;
}

PlyHeader read_ply_header(ByteSource& source) {
  return HeaderReader(source).read();
}

}  // namespace rattan
