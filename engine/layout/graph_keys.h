// SPDX-License-Identifier: MIT
#pragma once

// Names of the arrangement's elements that every tile agrees on.

#include <compare>
#include <cstdint>

namespace rattan::layout {

inline constexpr std::uint32_t kNone = 0xffffffffU;

/// A point of the arrangement: a scan vertex {v, v, 0}, the i-th crossing on a scan edge counted
/// from its lower vertex {lo, hi, i}, or the i-th crossing of two lines inside a triangle
/// {kInTriangle | triangle, 0, i}. As a piece of a scan edge, {lo, hi, i} is the part before point
/// i.
struct PointKey {
  std::uint64_t a = 0;
  std::uint64_t b = 0;
  std::uint32_t c = 0;
  friend auto operator<=>(const PointKey&, const PointKey&) = default;

  bool is_vertex() const { return a == b; }
  bool in_triangle() const { return (a & kInTriangle) != 0; }

  static constexpr std::uint64_t kInTriangle = std::uint64_t{1} << 63;
  static PointKey vertex(std::uint64_t v) { return {v, v, 0}; }
  static PointKey on_edge(std::uint64_t lo, std::uint64_t hi, std::uint32_t i) {
    return {lo, hi, i};
  }
  static PointKey inside(std::uint64_t triangle, std::uint32_t i) {
    return {kInTriangle | triangle, 0, i};
  }
};

}  // namespace rattan::layout
