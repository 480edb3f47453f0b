// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "engine/core/types.h"

namespace rattan {

/// Receives a scan as it streams from a file. Vertices are numbered from 0 in the order they come;
/// triangles may refer to vertices that come later and may come in any interleaving.
class ScanSink {
 public:
  virtual ~ScanSink() = default;
  /// File units, full double precision; may be non-finite.
  virtual void add_vertices(std::span<const Vec3d> positions) = 0;
  virtual void add_triangles(std::span<const std::array<std::uint64_t, 3>> triangles) = 0;
};

}  // namespace rattan
