// SPDX-License-Identifier: MIT
#pragma once

// The chart layout as a graph (PGP 3.3): charts, the strands between them, and the nodes where
// strands meet. Of output size, in memory; what lies inside the charts is in the store.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/types.h"

namespace rattan {

inline constexpr std::uint32_t kNoChart = 0xffffffffU;
inline constexpr std::uint32_t kNoNode = 0xffffffffU;

/// A curve on the surface between two nodes (or closed, without any) with one chart on either side.
/// Dart 2 s runs along strand s and has chart[0] on its left, dart 2 s + 1 runs back and has
/// chart[1].
struct ChartStrand {
  std::array<std::uint32_t, 2> node{kNoNode, kNoNode};     ///< kNoNode: closed
  std::array<std::uint32_t, 2> chart{kNoChart, kNoChart};  ///< [1] kNoChart: the scan's boundary
  /// For how many sides of charts it stands, at least 1 (closed ones: at least 3): charts have
  /// corners at i / parts of the way along it.
  std::uint32_t parts = 1;
  bool along_edges = false;  ///< runs along scan edges somewhere: boundary, feature, or cut

  bool closed() const { return node[0] == kNoNode; }
  bool boundary() const { return chart[1] == kNoChart; }
};

struct ChartGraph {
  /// Vertices of the layout's triangulation are numbered: first those of the scan, then the points
  /// where strands cross scan edges and each other, then the divisions of strands, then what is
  /// made inside charts. This is the first division's number.
  std::uint64_t first_division = 0;
  /// Into how many steps a chart side is divided: 1, or 2 if some chart has not four sides. A chart
  /// side is so many units long in parameter space.
  std::uint32_t units = 1;
  std::vector<Vec3d> node_position;        ///< relative to ScanMesh::origin
  std::vector<std::uint64_t> node_vertex;  ///< their numbers in the layout's triangulation
  std::vector<ChartStrand> strands;
  /// One a strand and one more: divisions of strand s are numbered first_division +
  /// division_begin[s] + i. An open strand has parts * units - 1 of them (what lies strictly
  /// inside, in the order of dart 2 s), a closed one parts * units (its own start first). A number
  /// may stay unused where a vertex that exists serves.
  std::vector<std::uint64_t> division_begin;
  /// Charts + 1, into ring_darts: the darts around each chart, counter-clockwise. The first side of
  /// a chart begins where the first dart does.
  std::vector<std::uint32_t> ring_begin{0};
  std::vector<std::uint32_t> ring_darts;
  std::vector<std::uint8_t> chart_singular;  ///< one a chart: there is a singularity in it

  std::uint32_t chart_count() const { return static_cast<std::uint32_t>(ring_begin.size() - 1); }
  std::span<const std::uint32_t> ring(std::uint32_t chart) const {
    return {ring_darts.data() + ring_begin[chart], ring_begin[chart + 1] - ring_begin[chart]};
  }
  /// N: how many corners the chart has.
  std::uint32_t sides(std::uint32_t chart) const {
    std::uint32_t n = 0;
    for (const std::uint32_t dart : ring(chart)) {
      n += strands[dart >> 1].parts;
    }
    return n;
  }
};

}  // namespace rattan
