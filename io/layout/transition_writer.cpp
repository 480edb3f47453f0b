// SPDX-License-Identifier: MIT
#include "io/layout/transition_writer.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <string_view>

#include "engine/core/errors.h"
#include "io/file/atomic_file.h"
#include "io/file/byte_source.h"
#include "io/file/text_numbers.h"
#include "io/file/text_writer.h"
#include "io/layout/layout_files.h"
#include "io/scan/scan_reader.h"

namespace rattan {
namespace {

constexpr std::string_view kAbout =
    "A part is the square [0, length]^2 in texture coordinates. Its sides 0 to 3 go "
    "counter-clockwise from (0, 0); unit u of a side is what lies from u to u + 1 along it. Where "
    "unit sides of two parts meet, p_b = R^turn p_a + (s, t) with R (x, y) = (-y, x).";

const char* name_of(ChartKind kind) {
  switch (kind) {
    case ChartKind::kUnfolded:
      return "unfolded";
    case ChartKind::kFlattened:
      return "flattened";
    case ChartKind::kSplit:
      break;
  }
  return "split";
}

/// In quotes; what is no UTF-8 becomes '?'.
std::string json_string(std::string_view text) {
  constexpr char kHex[] = "0123456789abcdef";
  std::string out = "\"";
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    const char c = text.front();
    if (length == 0) {
      out += '?';
    } else if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      out += "\\u00";
      out += kHex[c >> 4];
      out += kHex[c & 15];
    } else {
      out.append(text.substr(0, length));
    }
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return out + '"';
}

/// The file, into whatever takes bytes.
template <class Out>
class TransitionText {
 public:
  explicit TransitionText(Out& out) : line_(out) {}

  void write(const Transitions& all, std::span<const ChartKind> kinds,
             const RemeshMetadata& metadata) {
    line_.text("{\n");
    entry("rattan", metadata.version);
    entry("options", metadata.options);
    entry("input_sha256", metadata.input_hash);
    entry("about", kAbout);
    line_.text("\"chart_side\": ");
    line_.number(all.units);
    line_.text(",\n\"charts\": ");
    line_.number(kinds.size());
    list("parts", all.parts.size(), [&](std::size_t i) {
      const LayoutPart& part = all.parts[i];
      field("part", i);
      field("chart", part.chart);
      line_.text(", \"kind\": \"");
      line_.text(name_of(kinds[part.chart]));
      line_.text("\"");
      field("corner", part.corner);
      field("length", part.split ? 1U : all.units);
    });
    list("transitions", all.pairs.size(), [&](std::size_t i) {
      const Transition& t = all.pairs[i];
      field("part_a", t.a.part);
      field("side_a", unsigned{t.a.side});
      field("unit_a", unsigned{t.a.unit});
      field("part_b", t.b.part);
      field("side_b", unsigned{t.b.side});
      field("unit_b", unsigned{t.b.unit});
      field("turn", unsigned{t.turn});
      field("s", t.s);
      field("t", t.t);
      strand(t.strand);
    });
    list("boundary", all.boundary.size(), [&](std::size_t i) {
      const BoundarySide& b = all.boundary[i];
      field("part", b.side.part);
      field("side", unsigned{b.side.side});
      field("unit", unsigned{b.side.unit});
      strand(b.strand);
    });
    line_.text("\n}\n");
  }

 private:
  void entry(std::string_view name, std::string_view value) {
    line_.text("\"");
    line_.text(name);
    line_.text("\": ");
    line_.text(json_string(value));
    line_.text(",\n");
  }
  template <class Record>
  void list(std::string_view name, std::size_t count, const Record& record) {
    line_.text(",\n\"");
    line_.text(name);
    line_.text("\": [");
    for (std::size_t i = 0; i < count; ++i) {
      line_.text(i == 0 ? "\n{" : ",\n{");
      first_ = true;
      record(i);
      line_.text("}");
    }
    line_.text("\n]");
  }
  template <class Number>
  void field(std::string_view name, Number value) {
    line_.text(first_ ? "\"" : ", \"");
    first_ = false;
    line_.text(name);
    line_.text("\": ");
    line_.number(value);
  }
  void strand(std::uint32_t s) {
    if (s == kNoStrand) {
      line_.text(", \"strand\": null");
    } else {
      field("strand", s);
    }
  }

  TextWriter<Out> line_;
  bool first_ = true;
};

/// Takes what should stand in a file and looks whether it does.
class FileComparison {
 public:
  explicit FileComparison(const AtomicFile& file)
      : path_(file.path()), source_(file.temporary_path(), std::size_t{1} << 20, info_) {}

  void write(std::string_view meant) {
    if (!source_.fill(meant.size()) ||
        std::memcmp(source_.data(), meant.data(), meant.size()) != 0) {
      refuse_layout(path_, "byte " + std::to_string(source_.offset()) + " is another");
    }
    source_.consume(meant.size());
  }
  void end_of_file() {
    if (source_.fill(1)) {
      refuse_layout(path_, "it is longer");
    }
  }

 private:
  const std::string& path_;
  ScanFileInfo info_;
  ByteSource source_;
};

}  // namespace

std::string transitions_path(const std::string& output) {
  return std::filesystem::path(output).replace_extension(".charts.json").string();
}

std::uint64_t write_transitions(const Transitions& transitions, std::span<const ChartKind> kinds,
                                const RemeshMetadata& metadata, const std::string& path,
                                const std::function<void(const std::string&)>& before_verify) {
  for (const LayoutPart& part : transitions.parts) {
    ensure(part.chart < kinds.size(), "every chart of a layout has a kind");
  }
  AtomicFile file(path);
  TransitionText(file).write(transitions, kinds, metadata);
  file.sync();
  if (before_verify) {
    before_verify(file.temporary_path());
  }
  FileComparison comparison(file);
  TransitionText(comparison).write(transitions, kinds, metadata);
  comparison.end_of_file();
  const std::uint64_t bytes = file.size();
  file.commit();
  return bytes;
}

}  // namespace rattan
