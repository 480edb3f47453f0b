// SPDX-License-Identifier: MIT
#include "io/layout/layout_writer.h"

#include <cctype>
#include <filesystem>

#include "engine/core/errors.h"
#include "io/file/atomic_file.h"
#include "io/layout/layout_files.h"
#include "io/remesh/draco_grid.h"

namespace rattan {
namespace {

enum class LayoutFormat { kObj, kPly, kDraco };

LayoutFormat layout_format(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  for (char& c : extension) {
    c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  if (extension == ".obj") {
    return LayoutFormat::kObj;
  }
  if (extension == ".ply") {
    return LayoutFormat::kPly;
  }
  if (extension == ".drc") {
    return LayoutFormat::kDraco;
  }
  throw UsageError(path + ": a layout is an .obj, .ply or .drc file; '" + extension +
                   "' is none of them.");
}

// Buffers of writing and reading.
constexpr std::uint64_t kStreamBytes = std::uint64_t{4} << 20;

}  // namespace

void check_layout_output(const std::string& path, const LayoutWriteOptions& options) {
  layout_format(path);
  check_position_bits(options.position_bits);
}

std::uint64_t layout_write_bytes(const std::string& path, std::uint64_t triangles) {
  if (layout_format(path) != LayoutFormat::kDraco) {
    return kStreamBytes;
  }
  return kStreamBytes + triangles * kLayoutDracoBytes;
}

void refuse_layout(const std::string& path, const std::string& difference) {
  throw InternalError(path + ": read back to check, the file differs from the layout: " +
                      difference + ". Nothing was kept.");
}

LayoutWriteResult write_layout(LayoutSource& source, const RemeshMetadata& metadata,
                               const std::string& path, const LayoutWriteOptions& options) {
  const LayoutFormat format = layout_format(path);
  check_layout_output(path, options);
  AtomicFile file(path);
  LayoutWriteResult result;
  switch (format) {
    case LayoutFormat::kObj:
      result.folded = write_layout_obj(source, metadata, options, file);
      break;
    case LayoutFormat::kPly:
      result.folded = write_layout_ply(source, metadata, options, file);
      break;
    case LayoutFormat::kDraco:
      result = write_layout_draco(source, metadata, options, file);
      break;
  }
  result.bytes = file.size();
  file.commit();
  return result;
}

}  // namespace rattan
