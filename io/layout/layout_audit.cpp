// SPDX-License-Identifier: MIT
#include "io/layout/layout_audit.h"

#include <cmath>
#include <limits>

#include "engine/core/errors.h"

namespace rattan {

bool counter_clockwise(const Vec2d& a, const Vec2d& b, const Vec2d& c) {
  const double p = (b[0] - a[0]) * (c[1] - a[1]);
  const double q = (b[1] - a[1]) * (c[0] - a[0]);
  return p - q > 8.0 * std::numeric_limits<double>::epsilon() * (std::abs(p) + std::abs(q));
}

bool counter_clockwise_as_float(const Vec2d& a, const Vec2d& b, const Vec2d& c) {
  const auto rounded = [](const Vec2d& p) -> Vec2d { return p.cast<float>().cast<double>(); };
  return counter_clockwise(rounded(a), rounded(b), rounded(c));
}

void LayoutAudit::vertices(const LayoutVertices& block) {
  ensure(block.first == vertices_, "the vertices of a layout come in the order of their numbers");
  ensure(block.colour.size() == (size_.has_colours ? block.position.size() : 0),
         "every vertex of a layout has a colour or none has");
  for (const Vec3d& p : block.position) {
    ensure(p.allFinite(), "every position of a layout is finite");
  }
  vertices_ += block.position.size();
}

void LayoutAudit::chart(const LayoutChart& chart) {
  ensure(chart.chart == charts_ && chart.first_part == parts_ &&
             chart.first_texture_vertex == texture_vertices_,
         "charts, parts and texture vertices of a layout are numbered as they come");
  ensure(chart.vertex.size() == chart.uv.size() && chart.position.size() == chart.uv.size(),
         "every texture vertex of a layout has a vertex and a position");
  const std::size_t parts = chart.part_begin.size() - 1;
  ensure(chart.part_begin.size() > 1 && chart.part_uv_begin.size() == parts + 1 &&
             chart.part_begin.front() == 0 && chart.part_uv_begin.front() == 0 &&
             chart.part_begin.back() == chart.triangle.size() &&
             chart.part_uv_begin.back() == chart.uv.size(),
         "the parts of a chart hold all its triangles and texture vertices");
  for (std::size_t v = 0; v < chart.uv.size(); ++v) {
    ensure(chart.vertex[v] < size_.vertices, "every texture vertex of a layout names a vertex");
    ensure(chart.uv[v].allFinite() && chart.position[v].allFinite(),
           "every texture coordinate of a layout is finite");
  }
  for (std::size_t part = 0; part < parts; ++part) {
    ensure(chart.part_begin[part] < chart.part_begin[part + 1], "no part of a chart is empty");
    for (std::size_t t = chart.part_begin[part]; t < chart.part_begin[part + 1]; ++t) {
      for (const std::uint32_t v : chart.triangle[t]) {
        ensure(v >= chart.part_uv_begin[part] && v < chart.part_uv_begin[part + 1],
               "triangles of a part have its texture vertices");
      }
    }
  }
  ++charts_;
  parts_ += parts;
  texture_vertices_ += chart.uv.size();
  triangles_ += chart.triangle.size();
}

void LayoutAudit::end_vertices() const {
  ensure(vertices_ == size_.vertices, "a layout holds as many vertices as it says");
}

void LayoutAudit::end_charts() const {
  ensure(charts_ == size_.charts && parts_ == size_.parts &&
             texture_vertices_ == size_.texture_vertices && triangles_ == size_.triangles,
         "a layout holds as many charts, parts, texture vertices and triangles as it says");
}

std::string group_name(const LayoutChart& chart, std::size_t part) {
  std::string name = "chart_" + std::to_string(chart.chart);
  if (chart.part_begin.size() > 2) {
    name += "_part_" + std::to_string(part);
  }
  return name;
}

}  // namespace rattan
