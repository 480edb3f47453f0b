// SPDX-License-Identifier: MIT
#pragma once

// Whether a layout's stream is what it says; internal to io/layout.

#include <cstdint>
#include <string>

#include "engine/layout/layout_source.h"

namespace rattan {

/// Whether the triangle is counter-clockwise for sure, whatever double precision rounds away.
bool counter_clockwise(const Vec2d& a, const Vec2d& b, const Vec2d& c);
/// Likewise in float32.
bool counter_clockwise_as_float(const Vec2d& a, const Vec2d& b, const Vec2d& c);

/// Watches one pass over a layout. Throws InternalError for numbers that are not consecutive or out
/// of range and for values that are not finite.
class LayoutAudit {
 public:
  explicit LayoutAudit(const LayoutSize& size) : size_(size) {}
  void vertices(const LayoutVertices& block);
  void chart(const LayoutChart& chart);
  /// All vertices came, and all charts.
  void end_vertices() const;
  void end_charts() const;

 private:
  const LayoutSize size_;
  std::uint64_t vertices_ = 0;
  std::uint64_t texture_vertices_ = 0;
  std::uint64_t triangles_ = 0;
  std::uint64_t charts_ = 0;
  std::uint64_t parts_ = 0;
};

/// "chart_12", or "chart_12_part_3" of a chart in several parts.
std::string group_name(const LayoutChart& chart, std::size_t part);

}  // namespace rattan
