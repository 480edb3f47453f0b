// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/core/types.h"

namespace rattan {

/// Red, green, blue, alpha of a vertex.
using Rgba = std::array<std::uint8_t, 4>;

/// Receives a scan as it streams from a file. Vertices are numbered from 0 in the order they come;
/// faces may refer to vertices that come later and may come in any interleaving.
class ScanSink {
 public:
  virtual ~ScanSink() = default;
  /// File units, full double precision; may be non-finite.
  virtual void add_vertices(std::span<const Vec3d> positions) = 0;
  /// Red, green, blue, alpha (255 where the file has none) of the vertices of the add_vertices call
  /// just before, as many. For every block of vertices or, where the file has no colours, for none.
  virtual void add_colours(std::span<const Rgba> colours) { static_cast<void>(colours); }
  virtual void add_triangles(std::span<const std::array<std::uint64_t, 3>> triangles) = 0;
  /// Faces of more than three corners: how many each has, and the corners of one after another.
  /// Each begins at its lowest corner and never repeats a corner at once; it may repeat one later.
  /// By default a polygon becomes a fan around its first corner. A sink that knows all edges can
  /// cut better: see polygon_cutter.h.
  virtual void add_polygons(std::span<const std::uint32_t> sizes,
                            std::span<const std::uint64_t> corners) {
    std::size_t begin = 0;
    for (const std::uint32_t size : sizes) {
      for (std::size_t k = 2; k < size; ++k) {
        const std::array<std::uint64_t, 3> triangle{corners[begin], corners[begin + k - 1],
                                                    corners[begin + k]};
        add_triangles(std::span(&triangle, 1));
      }
      begin += size;
    }
  }
};

}  // namespace rattan
