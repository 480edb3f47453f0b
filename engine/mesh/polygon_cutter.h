// SPDX-License-Identifier: MIT
#pragma once

// Polygons into triangles, along diagonals that join no two vertices that an edge of the scan or a
// diagonal of another polygon joins already: where they would, another fan is taken.

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

#include "engine/core/spool.h"
#include "engine/core/store.h"

namespace rattan {

/// Add all polygons, then cut once. What comes out depends on the polygons, their order and the
/// triangles alone. Memory: `memory_bytes` given to cut(), and a block of the spool.
///
/// A polygon of n corners becomes the fan around one of its first min(n, 8) corners, tried in
/// order; the first has the lowest index. Of two that want the same diagonal the one that came
/// first has it. So of two quads around a vertex of valence two, or on the same four corners seen
/// from both sides, one takes its other diagonal. A polygon none of whose fans is free is cut
/// around its first corner, and repair deals with what comes of it; for a quad that means that both
/// diagonals are edges already. A polygon that repeats another, corner for corner and in the same
/// direction, is dropped.
class PolygonCutter {
 public:
  using Triangle = std::array<std::uint64_t, 3>;
  /// Calls its argument with all triangles of the scan that are not from polygons, block by block.
  using TriangleSource = std::function<void(const std::function<void(std::span<const Triangle>)>&)>;
  using Emit = std::function<void(std::span<const Triangle>)>;

  struct Counts {
    std::uint64_t turned = 0;      ///< polygons cut around another corner than the first
    std::uint64_t duplicates = 0;  ///< triangles that repeated polygons would have become
    std::uint64_t stuck = 0;       ///< polygons without a free fan
  };

  PolygonCutter(Store& store, std::size_t spool_block_bytes);

  /// As ScanSink::add_polygons.
  void add(std::span<const std::uint32_t> sizes, std::span<const std::uint64_t> corners);
  bool empty() const { return polygons_ == 0; }

  /// Frees the polygons.
  Counts cut(const TriangleSource& triangles, const Emit& emit, std::uint64_t memory_bytes);

 private:
  Store& store_;
  std::uint64_t polygons_ = 0;
  std::uint64_t diagonals_ = 0;  ///< that polygons may choose from
  /// Per polygon its number from 1, the count of its corners, and these.
  Spool<std::uint64_t> spool_;
};

}  // namespace rattan
