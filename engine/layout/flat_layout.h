// SPDX-License-Identifier: MIT
#pragma once

// All charts of a layout parameterized: the pass over them, what it leaves in the store, and the
// stream of it that writers read.

#include <array>
#include <cstdint>
#include <vector>

#include "engine/core/store.h"
#include "engine/core/task_graph.h"
#include "engine/layout/chart_extraction.h"
#include "engine/layout/flatten_chart.h"
#include "engine/layout/layout_source.h"
#include "engine/mesh/tile_mesh.h"
#include "engine/param/distortion.h"

namespace rattan {

struct FlatCounts {
  std::uint32_t charts = 0;
  std::uint32_t quads = 0;      ///< with four sides
  std::uint32_t unfolded = 0;   ///< assembled from the coordinates of their triangles
  std::uint32_t flattened = 0;  ///< four sides, mean value coordinates
  std::uint32_t split = 0;      ///< other than four sides
  std::uint32_t singular = 0;   ///< met by a singular triangle
  std::uint32_t bounded = 0;    ///< not singular, parameterized anew, at the scan's boundary
  std::uint64_t nudged = 0;     ///< texture vertices moved a little so that no triangle is thin
  std::uint64_t thin = 0;       ///< triangles thinner than the floor all the same

  FlatCounts& operator+=(const FlatCounts& o);
};

/// What is known of the parameterized charts, in memory: of output size.
struct FlatLayout {
  LayoutSize size;
  FlatCounts counts;
  double unit = 1.0;                      ///< length of a parameter unit on the surface, intended
  std::vector<std::uint32_t> part_begin;  ///< charts + 1
  std::vector<std::uint64_t> uv_begin;    ///< tiles + 1: texture vertices of the tile's charts
  std::vector<std::uint64_t> made_begin;  ///< tiles + 1: numbers of vertices made inside charts
  std::vector<std::uint8_t> chart_kind;   ///< one a chart: ChartKind
  std::vector<DistortionTotals> distortion;  ///< one a chart
  /// One a division of the graph: its number in the file, or ~0 where another vertex serves.
  std::vector<std::uint64_t> division_number;
  std::vector<Vec3d> division_position;  ///< one a division, whichever vertex serves
  std::vector<Rgba> division_colour;     ///< likewise, with colours
  std::vector<Vec3d> centre;             ///< one a chart: where (1, 1) of units 2 lies
};

template <class A>
void members_of(A& a, FlatLayout& l) {
  a(l.size);
  a(l.counts);
  a(l.unit);
  a(l.part_begin);
  a(l.uv_begin);
  a(l.made_begin);
  a(l.chart_kind);
  a(l.distortion);
  a(l.division_number);
  a(l.division_position);
  a(l.division_colour);
  a(l.centre);
}

/// Parameterizes every chart, tile by tile, and writes fields "layout/flat". `omega`: chart side, a
/// length. `relax`: rounds of relaxation across strands, a pass over the charts each. `sums`:
/// distortion over the surface.
FlatLayout flatten_layout(Store& store, const ScanMesh& mesh, const ChartLayout& layout,
                          double omega, int relax, TaskGraph& tasks, DistortionSums& sums);

/// The charts of a home tile as flatten_layout left them, in ascending order.
std::vector<FlatChart> load_flat_charts(Store& store, TileId tile);

/// Streams what flatten_layout left. All arguments outlive it.
class StoredLayout final : public LayoutSource {
 public:
  StoredLayout(Store& store, const ScanMesh& mesh, const ChartLayout& layout,
               const FlatLayout& flat, TaskGraph& tasks)
      : store_(store), mesh_(mesh), layout_(layout), flat_(flat), tasks_(tasks) {}

  LayoutSize size() const override { return flat_.size; }
  void for_each_vertices(const std::function<void(const LayoutVertices&)>& f) override;
  void for_each_chart(const std::function<void(const LayoutChart&)>& f) override;

 private:
  Store& store_;
  const ScanMesh& mesh_;
  const ChartLayout& layout_;
  const FlatLayout& flat_;
  TaskGraph& tasks_;
};

}  // namespace rattan
