// SPDX-License-Identifier: MIT
#include "io/scan/scan_reader.h"

#include <algorithm>
#include <string_view>

#include "engine/core/errors.h"
#include "io/file/text_numbers.h"
#include "io/scan/scan_parsers.h"

namespace rattan {
namespace {

enum class Format { kUnknown, kPly, kObj, kOff, kStl, kDraco };

// Without that of a compression: "ply" of "a.ply.gz".
std::string lower_extension(std::string path) {
  for (const std::string_view packed : {".gz", ".zst"}) {
    if (path.size() > packed.size() &&
        same_word(std::string_view(path).substr(path.size() - packed.size()), packed)) {
      path.resize(path.size() - packed.size());
    }
  }
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

Format tell_format(const ByteSource& source, std::string_view head) {
  const auto starts = [&](std::string_view magic) { return head.starts_with(magic); };
  if (starts("ply\n") || starts("ply\r") || starts("ply ")) {
    return Format::kPly;
  }
  if (starts("DRACO")) {
    return Format::kDraco;
  }
  if (is_off_keyword(head.substr(0, head.find('\n')))) {
    return Format::kOff;
  }
  const std::string extension = lower_extension(source.path());
  if (extension == "stl" || starts("solid ") || starts("solid\n") || starts("solid\r") ||
      is_binary_stl(source)) {
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
  if (extension == "drc") {
    return Format::kDraco;
  }
  return Format::kUnknown;
}

// What is told by its first bytes to be something else altogether.
void refuse_other_files(const std::string& path, std::string_view head) {
  const std::string convert = std::string("Convert the scan to ") + kSupportedFormats;
  static constexpr struct {
    std::string_view magic;
    const char* what;
    const char* remedy;
  } kOthers[] = {
      {"PK\x03\x04", "this is a ZIP archive", "Unpack it and name the scan inside"},
      {"\x1f\x8b", "the file is compressed twice", "Decompress it once"},
      {"\x28\xb5\x2f\xfd", "the file is compressed twice", "Decompress it once"},
      {"BZh", "bzip2 is not read", "Compress the scan with gzip or zstd"},
      {"\xfd"
       "7zXZ",
       "xz is not read", "Compress the scan with gzip or zstd"},
      {"\xff\xfe", "the text is encoded as UTF-16", "Save it as UTF-8"},
      {"\xfe\xff", "the text is encoded as UTF-16", "Save it as UTF-8"},
      {"glTF", "glTF is not read", nullptr},
      {"Kaydara", "FBX is not read", nullptr},
  };
  for (const auto& other : kOthers) {
    if (head.starts_with(other.magic)) {
      throw InputError(path, "", other.what, other.remedy != nullptr ? other.remedy : convert);
    }
  }
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
  if (!is_binary_stl(source)) {  // whose first 80 bytes are anything
    refuse_other_files(path, head);
  }
  ScanBlocks blocks(sink, result, options.block_records);
  switch (tell_format(source, head)) {
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
      read_stl(source, blocks, result);
      break;
    case Format::kDraco:
      read_draco(source, blocks, result, options.memory_bytes);
      break;
    case Format::kUnknown:
      throw InputError(path, "", "neither its first bytes nor its name tell a format Rattan reads",
                       std::string("Convert the scan to ") + kSupportedFormats);
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
