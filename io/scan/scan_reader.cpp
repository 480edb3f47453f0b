// SPDX-License-Identifier: MIT
#include "io/scan/scan_reader.h"

#include <algorithm>
#include <string_view>

#include "engine/core/errors.h"
#include "io/scan/scan_parsers.h"

namespace rattan {
namespace {

enum class Format { kUnknown, kPly, kObj, kOff, kStl, kDraco, kCompressed };

std::string lower_extension(const std::string& path) {
  const std::size_t slash = path.find_last_of('/');
  const std::size_t dot = path.find_last_of('.');
  if (dot == std::string::npos || (slash != std::string::npos && dot < slash)) {
    return "";
  }
  std::string extension = path.substr(dot + 1);
  for (char& c : extension) {
    c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return extension;
}

// The first line with anything in it must be a statement that OBJ files start with.
bool looks_like_obj(std::string_view head) {
  while (!head.empty()) {
    const std::size_t newline = head.find('\n');
    std::string_view line = head.substr(0, newline);
    head = newline == std::string_view::npos ? std::string_view() : head.substr(newline + 1);
    const std::size_t begin = line.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos || line[begin] == '#') {
      continue;
    }
    line = line.substr(begin);
    const std::string_view keyword = line.substr(0, line.find_first_of(" \t\r"));
    static constexpr std::string_view kStart[] = {"v", "vn", "vt",     "o",
                                                  "g", "s",  "mtllib", "usemtl"};
    return std::find(std::begin(kStart), std::end(kStart), keyword) != std::end(kStart);
  }
  return false;
}

Format tell_format(std::string_view head, const std::string& path) {
  const auto starts = [&](std::string_view magic) { return head.substr(0, magic.size()) == magic; };
  if (starts("ply\n") || starts("ply\r") || starts("ply ")) {
    return Format::kPly;
  }
  if (starts("DRACO")) {
    return Format::kDraco;
  }
  if (starts("\x1f\x8b") || starts("\x28\xb5\x2f\xfd")) {
    return Format::kCompressed;
  }
  if (is_off_keyword(head.substr(0, head.find('\n')))) {
    return Format::kOff;
  }
  const std::string extension = lower_extension(path);
  if (extension == "stl" || starts("solid ") || starts("solid\n") || starts("solid\r")) {
    return Format::kStl;
  }
  if (extension == "ply") {
    return Format::kPly;
  }
  if (extension == "off" || extension == "coff" || extension == "noff") {
    return Format::kOff;
  }
  if (extension == "obj" || looks_like_obj(head)) {
    return Format::kObj;
  }
  return Format::kUnknown;
}

}  // namespace

void read_scan(const std::string& path, ScanSink& sink, ScanFileInfo* info,
               const ScanReadOptions& options) {
  ScanFileInfo own;
  ScanFileInfo& result = info != nullptr ? *info : own;
  const bool want_sha256 = result.want_sha256;
  result = ScanFileInfo{};
  result.want_sha256 = want_sha256;

  ByteSource source(path, options.buffer_bytes, result);
  source.fill(512);
  std::string_view head(source.data(), std::min<std::size_t>(source.available(), 512));
  if (head.empty()) {
    throw InputError(path, "", "the file is empty",
                     std::string("Give a scan in ") + kSupportedFormats);
  }
  if (head.starts_with("\xef\xbb\xbf")) {  // the mark some editors put before text
    source.consume(3);
    head.remove_prefix(3);
  }
  const std::string convert = std::string("Convert the scan to ") + kSupportedFormats;
  ScanBlocks blocks(sink, result, options.block_records);
  switch (tell_format(head, path)) {
    case Format::kPly:
      read_ply(source, blocks, result);
      break;
    case Format::kObj:
      read_obj(source, blocks, result);
      break;
    case Format::kOff:
      read_off(source, blocks, result);
      break;
    case Format::kStl:
      throw InputError(path, "", "STL is not read yet", convert);
    case Format::kDraco:
      throw InputError(path, "", "Draco files are not read as scans yet", convert);
    case Format::kCompressed:
      throw InputError(path, "", "compressed files are not read yet",
                       std::string("Decompress the file to ") + kSupportedFormats);
    case Format::kUnknown:
      throw InputError(path, "", "neither its first bytes nor its name tell a format Rattan reads",
                       convert);
  }
  if (blocks.vertices() == 0) {
    throw InputError(path, "", "the file holds no vertices", "Check that the export is complete");
  }
  if (blocks.triangles() == 0) {
    throw InputError(path, "", "the file holds no triangles; it may be a point cloud",
                     "Reconstruct a triangle mesh from it first");
  }
  blocks.flush();
  source.drain();
  result.vertices = blocks.vertices();
  result.triangles = blocks.triangles();
}

}  // namespace rattan
