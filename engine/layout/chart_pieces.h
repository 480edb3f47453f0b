// SPDX-License-Identifier: MIT
#pragma once

// A tile's triangles cut along the arrangement's lines, each piece with its chart: what charts are
// assembled from.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/store.h"
#include "engine/core/types.h"
#include "engine/layout/chart_numbering.h"
#include "engine/layout/scan_arrangement.h"
#include "engine/mesh/scan_sink.h"

namespace rattan {

namespace layout {

struct PieceVertex {
  std::uint64_t number = 0;  ///< in the layout's triangulation
  Vec3f position;
  Rgba colour{};
};

/// A side within a scan triangle, as a turn.
inline constexpr std::uint8_t kNoTurn = 0xff;
inline constexpr std::uint8_t kOpenPiece = 1;  ///< its scan triangle has no consistent coordinates
/// It has coordinates, but its triangle has none as a whole: other pieces may see them differently.
inline constexpr std::uint8_t kPartialPiece = 4;
inline constexpr std::uint8_t kFoldedPiece = 2;  ///< its scan triangle is folded over in the plane

inline constexpr std::uint8_t kSingularPiece = kOpenPiece | kFoldedPiece;

/// Side k runs from corner k to the next.
struct PieceTriangle {
  std::uint32_t chart = 0;
  std::uint8_t flags = 0;
  /// Of sides on scan edges: quarter turns from the gauge of the edge's lower vertex to that of
  /// the scan triangle.
  std::array<std::uint8_t, 3> turn{kNoTurn, kNoTurn, kNoTurn};
  std::array<std::uint32_t, 3> vertex{};                   ///< of the chunk
  std::array<std::uint32_t, 3> dart{kNone, kNone, kNone};  ///< with the chart on its left
  /// (theta, phi) in periods, in one gauge for the whole triangle.
  std::array<std::array<float, 2>, 3> coordinate{};
};

struct ChartPieces {
  std::vector<PieceVertex> vertices;
  std::vector<PieceTriangle> triangles;  ///< ascending by chart
};

struct NumberedNode {
  std::uint32_t node = 0;
  std::uint64_t number = 0;
};

struct TilePieces {
  ChartPieces own;                             ///< of charts whose home the tile is
  ChartPieces foreign;                         ///< of other charts
  std::vector<PieceVertex> points;             ///< those that the tile numbers, in order
  std::vector<NumberedNode> nodes;             ///< among them
  std::vector<std::uint32_t> triangle_chart;   ///< one an owned triangle: that of most of its area
  std::vector<std::uint32_t> singular_charts;  ///< ascending: with a singularity in them
};

/// `colours`: one a local vertex, or empty.
TilePieces cut_tile(const OpenTile& tile, TileId id, const ChartNumbering& numbering,
                    std::span<const Rgba> colours);

}  // namespace layout

}  // namespace rattan
