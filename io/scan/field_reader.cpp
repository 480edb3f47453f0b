// SPDX-License-Identifier: MIT
#include "io/scan/field_reader.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "engine/core/errors.h"
#include "io/file/byte_source.h"
#include "io/file/text_numbers.h"
#include "io/scan/scan_reader.h"

namespace rattan {

namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 20;
constexpr std::size_t kBlock = 8192;
constexpr const char* kRepair = "Correct the line";

VertexDirection parse(const ByteSource& source, TextLine words) {
  double v[4] = {0.0, 0.0, 0.0, 1.0};
  for (int k = 0; k < 4 && !(k == 3 && words.at_end()); ++k) {
    if (words.at_end()) {
      source.fail_at_line("has " + std::to_string(k) + " numbers instead of three or four",
                          kRepair);
    }
    if (!words.number(v[k])) {
      source.fail_at_line(quoted(words.word()) + " is not a number", kRepair);
    }
    if (!std::isfinite(v[k])) {
      source.fail_at_line("holds a number that is not finite", kRepair);
    }
  }
  if (!words.at_end()) {
    source.fail_at_line("has more than four numbers", kRepair);
  }
  if (!(v[3] >= 0.0 && v[3] <= 1.0)) {
    source.fail_at_line("its fidelity is not between 0 and 1", kRepair);
  }
  const double largest = std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
  VertexDirection d;
  d.fidelity = static_cast<float>(v[3]);
  if (largest > 0.0) {
    const Vec3d scaled(v[0] / largest, v[1] / largest, v[2] / largest);
    d.direction = (scaled / scaled.norm()).cast<float>();
  }
  return d;
}

}  // namespace

std::string read_field(const std::string& path, std::uint64_t expected,
                       const std::function<void(std::span<const VertexDirection>)>& take) {
  ScanFileInfo info;
  info.want_sha256 = true;
  ByteSource source(path, kBufferBytes, info);
  std::vector<VertexDirection> block;
  std::uint64_t count = 0;
  std::string_view line;
  while (source.next_line(line)) {
    line = line.substr(0, line.find('#'));
    const TextLine words(line);
    if (TextLine(words).at_end()) {
      continue;
    }
    block.push_back(parse(source, words));
    ++count;
    if (block.size() == kBlock) {
      take(block);
      block.clear();
    }
  }
  take(block);
  if (count != expected) {
    throw InputError(path, "",
                     "it has " + std::to_string(count) + " vectors, but the scan file has " +
                         std::to_string(expected) + " vertices",
                     "Write one line for each vertex of the file, in its order");
  }
  source.drain();
  return info.sha256;
}

}  // namespace rattan
