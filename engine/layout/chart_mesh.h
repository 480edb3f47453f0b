// SPDX-License-Identifier: MIT
#pragma once

// One chart in memory: cut out of the scan (ChartMesh), and parameterized (FlatChart).

#include <array>
#include <cstdint>
#include <vector>

#include "engine/core/types.h"
#include "engine/mesh/scan_sink.h"

namespace rattan {

/// A vertex made inside a chart; it gets its number when all charts are done.
inline constexpr std::uint64_t kUnnumbered = ~std::uint64_t{0};
/// A triangle side inside the chart.
inline constexpr std::uint32_t kInsideChart = 0xffffffffU;

/// A disk: connected, manifold, with one boundary loop. Where the chart meets itself along a strand
/// it is cut open: each side has its own vertices, with the same numbers.
struct ChartMesh {
  std::uint32_t chart = 0;
  std::vector<std::uint64_t> number;  ///< one a vertex, in the layout's triangulation
  std::vector<Vec3d> position;        ///< one a vertex, relative to ScanMesh::origin
  std::vector<Rgba> colour;           ///< one a vertex, or empty
  std::vector<std::uint8_t> is_node;  ///< one a vertex: 1 at the ends of open strands
  /// Counter-clockwise, seen from outside the surface.
  std::vector<std::array<std::uint32_t, 3>> triangle;
  /// One a triangle; [k] of the side from corner k to the next: kInsideChart, or the dart that has
  /// the chart on its left.
  std::vector<std::array<std::uint32_t, 3>> dart;
  /// Likewise: by how many periods the coordinate along the strand changes over that side. The
  /// same from both charts; negative where coordinates say nothing (singular triangles, strands
  /// along scan edges).
  std::vector<std::array<double, 3>> step;
  /// One a vertex, in periods, with four corners at (0, 0), (1, 0), (1, 1), (0, 1), the first where
  /// the first side begins: the chart's triangles assembled. Empty if there is a singularity in the
  /// chart, it has not four sides, or it doesn't close to a unit square.
  std::vector<Vec2d> unfolded;
};

enum class ChartKind : std::uint8_t {
  kUnfolded,   ///< assembled from the coordinates of its triangles
  kFlattened,  ///< four sides: mean value coordinates (PGP Fig. 6 A, B)
  kSplit,      ///< other than four sides: cut into as many quadrilaterals (PGP Fig. 6 C, D)
};

/// A parameterized chart. `units` as in ChartGraph. One part [0, units]^2 with the chart's first
/// corner at the origin; of a split chart a part [0, 1]^2 for each corner i: the corner at the
/// origin, the middle of side i at (1, 0), the centre at (1, 1), the middle of side i - 1 at (0,
/// 1). All parts counter-clockwise like the surface. Texture vertices (`uv`) belong to one part
/// each.
struct FlatChart {
  std::uint32_t chart = 0;
  ChartKind kind = ChartKind::kUnfolded;
  std::vector<std::uint64_t> number;     ///< one a vertex; kUnnumbered: made inside
  std::vector<Vec3d> position;           ///< one a vertex
  std::vector<Rgba> colour;              ///< one a vertex, if the ChartMesh has colours
  std::vector<std::uint32_t> uv_vertex;  ///< one a texture vertex: its vertex
  std::vector<Vec2d> uv;                 ///< one a texture vertex
  std::vector<std::array<std::uint32_t, 3>> triangle;  ///< of texture vertices
  std::vector<std::uint32_t> part_begin{0};            ///< parts + 1, into triangle
  std::vector<std::uint32_t> part_uv_begin{0};         ///< parts + 1, into uv
  std::uint32_t centre = 0;                            ///< vertex; of split charts only
  std::uint32_t nudged = 0;  ///< texture vertices moved because a triangle was folded or too thin
  std::uint32_t thin = 0;    ///< triangles that stayed thinner than flat_disk.h's floor
};

}  // namespace rattan
