// SPDX-License-Identifier: MIT
#pragma once

// One function a format. Internal to io/layout.

#include <cstdint>
#include <string>

#include "engine/layout/layout_source.h"
#include "io/file/atomic_file.h"
#include "io/layout/layout_writer.h"
#include "io/remesh/remesh_metadata.h"

namespace rattan {

inline Vec3d full_position(const Vec3d& p, const RemeshMetadata& metadata,
                           const LayoutWriteOptions& options) {
  return p * options.unit + metadata.origin;
}

/// Each writes the whole file, syncs it, compares what is read back with the source, and leaves the
/// commit to the caller. Returns how many triangles are folded.
std::uint64_t write_layout_obj(LayoutSource& source, const RemeshMetadata& metadata,
                               const LayoutWriteOptions& options, AtomicFile& file);
std::uint64_t write_layout_ply(LayoutSource& source, const RemeshMetadata& metadata,
                               const LayoutWriteOptions& options, AtomicFile& file);

/// What write_layout_draco takes for a triangle at its peak: 190 bytes measured with Draco 1.5.5,
/// 230 with colours.
inline constexpr std::uint64_t kLayoutDracoBytes = 280;
LayoutWriteResult write_layout_draco(LayoutSource& source, const RemeshMetadata& metadata,
                                     const LayoutWriteOptions& options, AtomicFile& file);

/// What is written can be read at file.temporary_path().
inline void prepare_reading(AtomicFile& file, const LayoutWriteOptions& options) {
  file.sync();
  if (options.before_verify) {
    options.before_verify(file.temporary_path());
  }
}
[[noreturn]] void refuse_layout(const std::string& path, const std::string& difference);

}  // namespace rattan
