// SPDX-License-Identifier: MIT
#pragma once

// A layout's charts as pictures want them, tile by tile.

#include <array>
#include <cstdint>
#include <vector>

#include "engine/layout/flat_layout.h"
#include "io/picture/scene.h"

namespace rattan {

/// A colour for each chart, of a few quiet ones: not that of a neighbour as far as these suffice.
/// Charts with a singularity are reddish.
std::vector<Rgb> chart_tints(const ChartGraph& graph);

/// The charts of one home tile: tints, texture coordinates, borders.
class ChartPart {
 public:
  ChartPart(Store& store, const ChartGraph& graph, const std::vector<Rgb>& tints, TileId tile);
  /// Refers to this object's arrays.
  SceneMesh scene() const;

 private:
  void add_chart(const FlatChart& chart, const ChartGraph& graph, const Rgb& tint);

  std::vector<Vec3f> positions_;
  std::vector<LocalTriangle> triangles_;
  std::vector<std::array<float, 2>> corner_uv_;
  std::vector<Rgb> tints_;
  std::vector<SurfaceLine> lines_;
};

}  // namespace rattan
