// SPDX-License-Identifier: MIT
#pragma once

// Layouts in memory, for the tests of whatever reads a LayoutSource.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "engine/layout/layout_source.h"

namespace rattan::testing {

/// Vertices by number, and charts; `vertices` of a chart are numbers.
class MemoryLayout : public LayoutSource {
 public:
  std::uint32_t units = 1;
  std::vector<Vec3d> position;
  std::vector<Rgba> colour;  ///< one a vertex, or empty
  std::vector<FlatChart> charts;

  LayoutSize size() const override {
    LayoutSize s;
    s.vertices = position.size();
    s.charts = static_cast<std::uint32_t>(charts.size());
    s.units = units;
    s.has_colours = !colour.empty();
    for (const FlatChart& c : charts) {
      s.texture_vertices += c.uv.size();
      s.triangles += c.triangle.size();
      s.parts += static_cast<std::uint32_t>(c.part_begin.size() - 1);
    }
    return s;
  }
  void for_each_vertices(const std::function<void(const LayoutVertices&)>& f) override {
    constexpr std::size_t kRun = 1000;
    for (std::size_t i = 0; i < position.size(); i += kRun) {
      const std::size_t n = std::min(kRun, position.size() - i);
      LayoutVertices v;
      v.first = i;
      v.position = std::span(position).subspan(i, n);
      v.colour = colour.empty() ? std::span<const Rgba>() : std::span(colour).subspan(i, n);
      f(v);
    }
  }
  void for_each_chart(const std::function<void(const LayoutChart&)>& f) override {
    LayoutChart out;
    for (const FlatChart& c : charts) {
      std::vector<std::uint64_t> vertex;
      std::vector<Vec3d> positions;
      std::vector<Rgba> colours;
      for (const std::uint32_t v : c.uv_vertex) {
        vertex.push_back(c.number[v]);
        positions.push_back(position[c.number[v]]);
        if (!colour.empty()) {
          colours.push_back(colour[c.number[v]]);
        }
      }
      out.chart = c.chart;
      out.kind = c.kind;
      out.vertex = vertex;
      out.position = positions;
      out.colour = colours;
      out.uv = c.uv;
      out.triangle = c.triangle;
      out.part_begin = c.part_begin;
      out.part_uv_begin = c.part_uv_begin;
      f(out);
      out.first_part += static_cast<std::uint32_t>(c.part_begin.size() - 1);
      out.first_texture_vertex += c.uv.size();
    }
  }
};

/// A sheet [0, columns] x [0, rows] over `lift`, one chart a unit square, each a grid of 2 k x 2 k
/// squares cut in two, whose texture coordinates bulge inside so that they aren't proportional to
/// positions. Charts for which `is_split` says so are cut into four parts. Counter-clockwise seen
/// from above.
inline MemoryLayout sheet_layout(std::uint32_t columns, std::uint32_t rows, std::uint32_t k,
                                 const std::function<bool(std::uint32_t)>& is_split = {},
                                 const std::function<Vec3d(double, double)>& lift = {}) {
  MemoryLayout layout;
  layout.units = 2;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint64_t> number;
  const std::uint32_t n = 2 * k;
  const auto vertex_at = [&](std::uint32_t x, std::uint32_t y) {
    const auto [at, is_new] = number.try_emplace({x, y}, layout.position.size());
    if (is_new) {
      const double u = static_cast<double>(x) / n;
      const double v = static_cast<double>(y) / n;
      layout.position.push_back(lift ? lift(u, v) : Vec3d(u, v, 0.0));
    }
    return at->second;
  };
  const auto bulge = [](double t) { return t + 0.1 * std::sin(6.283185307179586 * t); };
  for (std::uint32_t c = 0; c < columns * rows; ++c) {
    FlatChart chart;
    chart.chart = c;
    const bool split = is_split && is_split(c);
    chart.kind = split ? ChartKind::kSplit : ChartKind::kUnfolded;
    const std::uint32_t x0 = c % columns * n;
    const std::uint32_t y0 = c / columns * n;
    // A square of m x m steps; (i, j) of it in steps of the chart and in texture coordinates.
    const auto add_part = [&](std::uint32_t m, double length, const auto& in_chart) {
      const auto first = static_cast<std::uint32_t>(chart.uv.size());
      for (std::uint32_t j = 0; j <= m; ++j) {
        for (std::uint32_t i = 0; i <= m; ++i) {
          const auto [x, y] = in_chart(i, j);
          chart.uv_vertex.push_back(static_cast<std::uint32_t>(chart.number.size()));
          chart.number.push_back(vertex_at(x0 + x, y0 + y));
          chart.position.push_back(layout.position[chart.number.back()]);
          chart.uv.emplace_back(i == m ? length : length * bulge(double(i) / m),
                                j == m ? length : length * bulge(double(j) / m));
        }
      }
      for (std::uint32_t j = 0; j < m; ++j) {
        for (std::uint32_t i = 0; i < m; ++i) {
          const std::uint32_t a = first + j * (m + 1) + i;
          chart.triangle.push_back({a, a + 1, a + m + 2});
          chart.triangle.push_back({a, a + m + 2, a + m + 1});
        }
      }
      chart.part_begin.push_back(static_cast<std::uint32_t>(chart.triangle.size()));
      chart.part_uv_begin.push_back(static_cast<std::uint32_t>(chart.uv.size()));
    };
    if (!split) {
      add_part(n, 2.0, [](std::uint32_t i, std::uint32_t j) { return std::pair(i, j); });
    } else {
      add_part(k, 1.0, [](std::uint32_t i, std::uint32_t j) { return std::pair(i, j); });
      add_part(k, 1.0, [&](std::uint32_t i, std::uint32_t j) { return std::pair(n - j, i); });
      add_part(k, 1.0, [&](std::uint32_t i, std::uint32_t j) { return std::pair(n - i, n - j); });
      add_part(k, 1.0, [&](std::uint32_t i, std::uint32_t j) { return std::pair(j, n - i); });
    }
    layout.charts.push_back(std::move(chart));
  }
  return layout;
}

/// The size of the whole-and-split mixture that `split_parts` (as AtlasPlan takes it) stands for.
inline LayoutSize size_of(const std::vector<std::uint32_t>& split_parts) {
  LayoutSize size;
  size.charts = static_cast<std::uint32_t>(split_parts.size());
  for (const std::uint32_t n : split_parts) {
    size.parts += std::max(n, 1U);
    size.units = n > 0 ? 2 : size.units;
  }
  return size;
}

}  // namespace rattan::testing
