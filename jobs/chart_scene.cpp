// SPDX-License-Identifier: MIT
#include "jobs/chart_scene.h"

#include <algorithm>

namespace rattan {

namespace {

constexpr std::array<Rgb, 8> kTints{{{205, 214, 226},
                                     {221, 213, 192},
                                     {190, 211, 198},
                                     {212, 201, 219},
                                     {171, 193, 209},
                                     {229, 224, 212},
                                     {194, 198, 176},
                                     {184, 184, 205}}};
constexpr std::array<Rgb, 2> kSingularTints{{{232, 150, 132}, {222, 132, 122}}};

/// Where a point of a chart's rim lies: a bit for each of the four sides of its part.
unsigned sides_at(const Vec2d& uv, double length) {
  return (uv.y() == 0.0 ? 1U : 0U) | (uv.x() == length ? 2U : 0U) | (uv.y() == length ? 4U : 0U) |
         (uv.x() == 0.0 ? 8U : 0U);
}

}  // namespace

std::vector<Rgb> chart_tints(const ChartGraph& graph) {
  constexpr std::uint8_t kUndecided = 0xff;
  std::vector<std::uint8_t> colour(graph.chart_count(), kUndecided);
  for (std::uint32_t c = 0; c < graph.chart_count(); ++c) {
    std::array<std::uint32_t, kTints.size()> beside{};
    for (const std::uint32_t dart : graph.ring(c)) {
      const std::uint32_t other = graph.strands[dart >> 1].chart[(dart & 1U) ^ 1U];
      if (other != kNoChart && colour[other] != kUndecided) {
        ++beside[colour[other]];
      }
    }
    // From a place that changes along rows of charts, so that all colours are used.
    std::size_t best = (c * std::size_t{5}) % kTints.size();
    for (std::size_t k = 1; k < kTints.size(); ++k) {
      const std::size_t next = (c * std::size_t{5} + k) % kTints.size();
      best = beside[next] < beside[best] ? next : best;
    }
    colour[c] = static_cast<std::uint8_t>(best);
  }
  std::vector<Rgb> tints(colour.size());
  for (std::uint32_t c = 0; c < tints.size(); ++c) {
    tints[c] = graph.chart_singular[c] != 0 ? kSingularTints[colour[c] % kSingularTints.size()]
                                            : kTints[colour[c]];
  }
  return tints;
}

ChartPart::ChartPart(Store& store, const ChartGraph& graph, const std::vector<Rgb>& tints,
                     TileId tile) {
  for (const FlatChart& chart : load_flat_charts(store, tile)) {
    add_chart(chart, graph, tints[chart.chart]);
  }
}

void ChartPart::add_chart(const FlatChart& chart, const ChartGraph& graph, const Rgb& tint) {
  const auto first = static_cast<std::uint32_t>(positions_.size());
  for (const Vec3d& p : chart.position) {
    positions_.push_back(p.cast<float>());
  }
  const bool is_split = chart.kind == ChartKind::kSplit;
  const double length = is_split ? 1.0 : graph.units;
  const LineKind border =
      graph.chart_singular[chart.chart] != 0 ? LineKind::kSingularBorder : LineKind::kChartBorder;
  for (const auto& t : chart.triangle) {
    std::array<unsigned, 3> sides{};
    LocalTriangle corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2d& uv = chart.uv[t[k]];
      corners[k] = first + chart.uv_vertex[t[k]];
      sides[k] = sides_at(uv, length);
      corner_uv_.push_back({static_cast<float>(uv.x()), static_cast<float>(uv.y())});
    }
    triangles_.push_back(corners);
    tints_.push_back(tint);
    for (std::size_t k = 0; k < 3; ++k) {
      // No triangle has an edge inside that joins two points of one side.
      const unsigned on = sides[k] & sides[(k + 1) % 3];
      if (on != 0) {
        const bool between_parts = is_split && (on & 6U) != 0;
        lines_.push_back({positions_[corners[k]], positions_[corners[(k + 1) % 3]],
                          between_parts ? LineKind::kPartBorder : border});
      }
    }
  }
}

SceneMesh ChartPart::scene() const {
  SceneMesh out;
  out.positions = positions_;
  out.triangles = triangles_;
  out.corner_uv = corner_uv_;
  out.tints = tints_;
  out.lines = lines_;
  return out;
}

}  // namespace rattan
