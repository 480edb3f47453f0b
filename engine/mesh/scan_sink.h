// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "engine/core/types.h"

namespace rattan {

/// Red, green, blue, alpha of a vertex.
using Rgba = std::array<std::uint8_t, 4>;

/// Receives a scan as it streams from a file. Vertices are numbered from 0 in the order they come;
/// triangles may refer to vertices that come later and may come in any interleaving.
class ScanSink {
 public:
  virtual ~ScanSink() = default;
  /// File units, full double precision; may be non-finite.
  virtual void add_vertices(std::span<const Vec3d> positions) = 0;
  /// Red, green, blue, alpha (255 where the file has none) of the vertices of the add_vertices call
  /// just before, as many. For every block of vertices or, where the file has no colours, for none.
  virtual void add_colours(std::span<const Rgba> colours) { static_cast<void>(colours); }
  virtual void add_triangles(std::span<const std::array<std::uint64_t, 3>> triangles) = 0;
};

}  // namespace rattan
