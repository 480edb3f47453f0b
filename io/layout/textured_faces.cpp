// SPDX-License-Identifier: MIT
#include "io/layout/textured_faces.h"

#include <string_view>

#include "io/file/byte_source.h"
#include "io/scan/scan_blocks.h"

namespace rattan {
namespace {

/// Ends like the word, in whatever case, compressed or not.
bool is_called(std::string_view path, std::string_view ending) {
  std::string lower(path);
  for (char& c : lower) {
    c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  for (const std::string_view packed : {".gz", ".zst", ".zstd"}) {
    if (lower.ends_with(packed)) {
      lower.resize(lower.size() - packed.size());
      break;
    }
  }
  return lower.ends_with(ending);
}

bool begins_like_ply(const std::string& scan) {
  ScanFileInfo info;
  ByteSource source(scan, 4096, info);
  return source.fill(4) && std::string_view(source.data(), 3) == "ply" &&
         (source.data()[3] == '\n' || source.data()[3] == '\r');
}

}  // namespace

std::vector<Material> read_textured_faces(const std::string& scan, TexturedFaceSink& sink,
                                          bool pictures_only) {
  if (begins_like_ply(scan)) {
    return read_textured_ply(scan, sink, pictures_only);
  }
  return is_called(scan, ".obj") ? read_textured_obj(scan, sink) : std::vector<Material>();
}

}  // namespace rattan
