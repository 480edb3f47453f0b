// SPDX-License-Identifier: MIT
#pragma once

// A finished layout as a stream, however large: what writers, atlas and pictures read.

#include <array>
#include <cstdint>
#include <functional>
#include <span>

#include "engine/core/types.h"
#include "engine/layout/chart_mesh.h"
#include "engine/mesh/scan_sink.h"

namespace rattan {

struct LayoutSize {
  std::uint64_t vertices = 0;
  std::uint64_t texture_vertices = 0;
  std::uint64_t triangles = 0;
  std::uint32_t charts = 0;
  std::uint32_t parts = 0;
  std::uint32_t units = 1;  ///< length of a chart side in texture coordinates
  bool has_colours = false;
};

/// A run of vertices in the order of their numbers.
struct LayoutVertices {
  std::uint64_t first = 0;
  std::span<const Vec3d> position;  ///< relative to the origin
  std::span<const Rgba> colour;     ///< empty without colours
};

/// One chart; see FlatChart. Valid during the call it is given to.
struct LayoutChart {
  std::uint32_t chart = 0;
  ChartKind kind = ChartKind::kUnfolded;
  std::uint32_t first_part = 0;                            ///< parts are numbered over all charts
  std::uint64_t first_texture_vertex = 0;                  ///< likewise
  std::span<const std::uint64_t> vertex;                   ///< one a texture vertex: its number
  std::span<const Vec3d> position;                         ///< one a texture vertex
  std::span<const Rgba> colour;                            ///< one a texture vertex, or empty
  std::span<const Vec2d> uv;                               ///< one a texture vertex
  std::span<const std::array<std::uint32_t, 3>> triangle;  ///< of the chart's texture vertices
  std::span<const std::uint32_t> part_begin;               ///< parts + 1, into triangle
  std::span<const std::uint32_t> part_uv_begin;            ///< parts + 1, into uv
};

class LayoutSource {
 public:
  virtual ~LayoutSource() = default;
  virtual LayoutSize size() const = 0;
  /// Calls in ascending order, from one thread; every vertex once. May be repeated.
  virtual void for_each_vertices(const std::function<void(const LayoutVertices&)>& f) = 0;
  /// Charts in ascending order, from one thread. May be repeated.
  virtual void for_each_chart(const std::function<void(const LayoutChart&)>& f) = 0;
};

}  // namespace rattan
