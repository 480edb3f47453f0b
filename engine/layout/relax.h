// SPDX-License-Identifier: MIT
#pragma once

// Smoothing the map across chart boundaries (after Khodakovsky, Litke, Schroeder 2003): points on
// strands slide along them to where their neighbours on both sides, transported into one frame,
// want them by mean value weights. Nodes and divisions stay, and so do the charts' sides.
//
// In rounds, in each of which charts are independent:
//   StrandRelaxation relaxation(graph);
//   repeat kRelaxRounds times:
//     for each chart with relaxation.touches(chart), in any order:
//       flat = flatten_chart(mesh, graph, {relaxation.given()});
//       relaxation.add(rim_wishes(flat, graph));
//     relaxation.end_round();
//   flatten all charts once more with relaxation.given().

#include <cstdint>
#include <span>
#include <vector>

#include "engine/layout/chart_graph.h"
#include "engine/layout/chart_mesh.h"
#include "engine/layout/divide_sides.h"

namespace rattan {

inline constexpr int kRelaxRounds = 6;

/// What a chart's vertices beside one strand say.
struct StrandWish {
  std::uint32_t strand = 0;
  std::vector<double> at;      ///< one a point of the strand, as layout::StrandPoint::at
  std::vector<double> sum;     ///< one a point: where the neighbours are along the strand, weighted
  std::vector<double> weight;  ///< one a point: the weights' sum; 0 at ends and divisions
};

/// One for each dart around the chart.
std::vector<StrandWish> rim_wishes(const FlatChart& chart, const ChartGraph& graph);

/// In memory: some 24 bytes a point of the strands that move, which are those inside the scan with
/// a chart on either side that is singular or has not four sides.
class StrandRelaxation {
 public:
  explicit StrandRelaxation(const ChartGraph& graph);

  bool moves(std::uint32_t strand) const { return moves_[strand] != 0; }
  /// Some of the chart's strands move.
  bool touches(std::uint32_t chart) const { return touches_[chart] != 0; }
  /// Ignores strands that stay. One call at a time; the result doesn't depend on their order.
  void add(std::span<const StrandWish> wishes);
  /// Moves all points as far as wished. Returns by how many units at most. Throws InternalError if
  /// a strand that moves was not added by both of its charts.
  double end_round();
  /// For FlattenOptions: valid while this object is, constant until end_round().
  layout::GivenParameters given() const;

 private:
  struct Points {
    std::vector<double> at;
    std::vector<double> sum;
    std::vector<double> weight;
    std::uint32_t added = 0;
  };
  std::vector<std::uint8_t> moves_;    ///< one a strand
  std::vector<std::uint8_t> touches_;  ///< one a chart
  std::vector<Points> points_;         ///< one a strand
};

}  // namespace rattan
