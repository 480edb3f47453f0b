// SPDX-License-Identifier: MIT
#include <algorithm>
#include <bit>
#include <cstring>

#include "io/file/text_numbers.h"
#include "io/scan/scan_parsers.h"

namespace rattan {
namespace {

constexpr const char* kRepair = "Export the scan again or correct the line";
constexpr const char* kCutOff = "It is cut off; copy or export it again";
constexpr std::size_t kHeaderBytes = 84;  // 80 of any text, then the count
constexpr std::size_t kRecordBytes = 50;  // normal, three corners, two bytes of anything
constexpr std::uint64_t kUncounted = ~std::uint64_t{0};

std::uint32_t load_u32(const char* p) {
  std::uint32_t word = 0;
  std::memcpy(&word, p, sizeof(word));
  return std::endian::native == std::endian::little ? word : __builtin_bswap32(word);
}

double load_float(const char* p) {
  return std::bit_cast<float>(load_u32(p));
}

// Both kinds may begin with "solid". The size settles it; where it is not known or the file is cut
// off, a zero byte does: text has none, and a count below 2^24 has one.
bool is_binary(const ByteSource& source) {
  if (is_binary_stl(source)) {
    return true;
  }
  const std::string_view head(source.data(), std::min<std::size_t>(source.available(), 512));
  const std::size_t begin = head.find_first_not_of(" \t\r\n");
  const bool says_solid =
      begin != std::string_view::npos && same_word(head.substr(begin, 5), "solid");
  return !says_solid || head.find('\0') != std::string_view::npos;
}

// How many records to read; kUncounted: to the end of the file.
std::uint64_t binary_count(const ByteSource& source) {
  const std::uint32_t declared = load_u32(source.data() + 80);
  // Programs that write before they know the count leave one of these.
  const bool unset = declared == 0 || declared == 0xffffffffU;
  if (source.content_bytes() == 0) {
    return unset ? kUncounted : declared;
  }
  const std::uint64_t room = (source.content_bytes() - kHeaderBytes) / kRecordBytes;
  // The count has only 32 bits; a larger file shows its lowest ones.
  const bool exact = (source.content_bytes() - kHeaderBytes) % kRecordBytes == 0;
  if (unset || (exact && static_cast<std::uint32_t>(room) == declared)) {
    return kUncounted;
  }
  if (room < declared) {
    source.fail_at_byte(source.content_bytes(),
                        "the file ends after " + std::to_string(room) + " of the " +
                            std::to_string(declared) + " triangles its header declares",
                        kCutOff);
  }
  return declared;
}

void read_binary_stl(ByteSource& source, ScanBlocks& blocks, ScanFileInfo& info) {
  if (!source.fill(kHeaderBytes)) {
    source.fail_at_byte(source.offset() + source.available(),
                        "the file ends inside the 84 bytes of an STL header", kCutOff);
  }
  const std::uint64_t count = binary_count(source);
  info.triangles =
      count == kUncounted
          ? (std::max<std::uint64_t>(source.content_bytes(), kHeaderBytes) - kHeaderBytes) /
                kRecordBytes
          : count;
  info.vertices = 3 * info.triangles;
  source.consume(kHeaderBytes);
  std::uint64_t done = 0;
  while (done < count && source.fill(kRecordBytes)) {
    const std::uint64_t block =
        std::min<std::uint64_t>(count - done, source.available() / kRecordBytes);
    const char* p = source.data();
    for (std::uint64_t r = 0; r < block; ++r, p += kRecordBytes) {
      for (const char* q = p + 12; q != p + 48; q += 12) {
        blocks.add_vertex(load_float(q), load_float(q + 4), load_float(q + 8));
      }
      const std::uint64_t first = 3 * (done + r);
      blocks.add_triangle(first, first + 1, first + 2);
    }
    source.consume(static_cast<std::size_t>(block * kRecordBytes));
    done += block;
  }
  if (count == kUncounted ? source.available() > 0 : done < count) {
    source.fail_at_byte(source.offset() + source.available(),
                        "the file ends inside triangle " + std::to_string(done + 1) +
                            (count == kUncounted ? "" : " of " + std::to_string(count)),
                        kCutOff);
  }
}

class StlText {
 public:
  StlText(ByteSource& source, ScanBlocks& blocks) : source_(source), blocks_(blocks) {}

  void read() {
    std::string_view line;
    while (source_.next_line(line)) {
      TextLine words(line);
      for (std::string_view word = words.word(); !word.empty(); word = words.word()) {
        if (same_word(word, "vertex")) {
          read_vertex(words);
        } else if (same_word(word, "solid") || same_word(word, "endsolid")) {
          open_ = same_word(word, "solid");
          break;  // a name of any kind
        } else {
          read_word(word, words);
        }
      }
    }
    if (open_) {
      source_.fail_at_line("the file ends without \"endsolid\"", kCutOff);
    }
  }

 private:
  void read_word(std::string_view word, TextLine& words) {
    if (same_word(word, "facet")) {
      if (in_loop_) {
        source_.fail_at_line("a facet begins inside another", kRepair);
      }
    } else if (same_word(word, "normal") || same_word(word, "color")) {
      for (int k = 0; k < 3; ++k) {
        words.word();
      }
    } else if (same_word(word, "outer")) {
      words.word();  // "loop"
    } else if (same_word(word, "endloop") || same_word(word, "endfacet")) {
      if (in_loop_) {
        blocks_.end_polygon();
        in_loop_ = false;
      }
    } else {
      source_.fail_at_line(quoted(word) + " is not a word of an STL file", kRepair);
    }
  }

  void read_vertex(TextLine& words) {
    double p[3];
    for (double& value : p) {
      if (!words.number(value)) {
        const std::string_view word = words.word();
        source_.fail_at_line(word.empty() ? "a vertex has fewer than three coordinates"
                                          : quoted(word) + " is not a number",
                             kRepair);
      }
    }
    if (!in_loop_) {
      in_loop_ = true;
      blocks_.begin_polygon();
    }
    blocks_.add_corner(blocks_.vertices());
    blocks_.add_vertex(p[0], p[1], p[2]);
  }

  ByteSource& source_;
  ScanBlocks& blocks_;
  bool open_ = false;
  bool in_loop_ = false;
};

}  // namespace

bool is_binary_stl(const ByteSource& source) {
  return source.available() >= kHeaderBytes && source.content_bytes() > kHeaderBytes &&
         (source.content_bytes() - kHeaderBytes) % kRecordBytes == 0 &&
         (source.content_bytes() - kHeaderBytes) / kRecordBytes == load_u32(source.data() + 80);
}

void read_stl(ByteSource& source, ScanBlocks& blocks, ScanFileInfo& info) {
  source.fill(512);
  if (is_binary(source)) {
    info.format = "STL, binary";
    read_binary_stl(source, blocks, info);
  } else {
    info.format = "STL, ASCII";
    StlText(source, blocks).read();
  }
}

}  // namespace rattan
