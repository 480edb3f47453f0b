// SPDX-License-Identifier: MIT
#pragma once

// All charts of a layout in the unit square.

#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/types.h"
#include "engine/layout/layout_source.h"

namespace rattan {

struct AtlasOptions {
  /// Side of the image that the atlas is meant for, in texels; 0: none in particular.
  std::uint32_t image_size = 0;
  /// Least distance between two parts, in texels of that image, at least 1. Without an image it is
  /// 1/1024 of the atlas, or an eighth of a chart with its gutter where charts are so small.
  std::uint32_t gutter = 4;
};

/// Where a part lies, in texels counted from the lower left corner of the atlas. Its corner (0, 0)
/// is the centre of texel (x, y), the corner opposite that of (x + side, y + side): so parts that
/// share a side on the surface have texels at the same points of it where they are of one size, and
/// bilinear filtering shows no seam. No other part is near the texels [x_begin, x_end) x [y_begin,
/// y_end).
struct AtlasPart {
  std::uint32_t x = 0;
  std::uint32_t y = 0;
  std::uint32_t side = 0;
  std::uint32_t x_begin = 0;
  std::uint32_t x_end = 0;
  std::uint32_t y_begin = 0;
  std::uint32_t y_end = 0;
};

/// atlas = origin + scale * uv.
struct AtlasMap {
  Vec2d origin = Vec2d::Zero();
  double scale = 1.0;
};

/// Whole charts fill the cells of a grid, all of one size; parts of split charts fill quarters of
/// cells. Cells are taken along a Hilbert curve, so that charts with near numbers, which are near
/// on the surface, are near in the atlas. Neither turned nor mirrored. 8 bytes a part.
class AtlasPlan {
 public:
  /// `split_parts`: one a chart, of how many parts a split chart is made; 0 for a whole one. Throws
  /// UsageError if the image is too small.
  AtlasPlan(const LayoutSize& size, std::span<const std::uint32_t> split_parts,
            const AtlasOptions& options = {});

  /// By LayoutChart::first_part + i.
  AtlasPart part(std::uint64_t number) const;
  AtlasMap map(std::uint64_t number) const;
  std::uint64_t parts() const { return cells_.size(); }
  /// What no part has: x_begin to y_end only.
  std::vector<AtlasPart> free() const;
  /// Texels of a side of the atlas: those of the image, or of a grid fine enough where there is
  /// none.
  std::uint32_t size() const { return size_; }
  std::uint32_t gutter() const { return gutter_; }
  /// Of a whole chart, in parts of the atlas's side.
  double chart_side() const { return static_cast<double>(whole_side_) / size_; }
  /// Share of the atlas's area that parts cover.
  double efficiency() const { return efficiency_; }
  /// Bits a coordinate in [0, 1) needs to lie on a grid as fine as one of 2^unit_bits steps a unit
  /// of the smallest part: what a quantised file must keep where coordinates bear such a rounding.
  /// Single precision has 24.
  std::uint32_t bits(std::uint32_t unit_bits) const;

 private:
  struct Cell {
    std::uint32_t column = 0;
    std::uint32_t row : 29 = 0;
    std::uint32_t quarter : 3 = kWhole;  // bit 0: right, bit 1: upper
  };
  static constexpr std::uint32_t kWhole = 4;
  AtlasPart place(const Cell& cell) const;

  std::uint32_t units_;
  std::uint32_t size_;
  std::uint32_t gutter_ = 0;
  std::uint32_t columns_ = 1;
  std::uint32_t rows_ = 1;
  std::uint32_t whole_side_ = 0;
  std::uint32_t split_side_ = 0;
  double efficiency_ = 0.0;
  std::vector<Cell> cells_;  // one a part
  std::vector<Cell> free_;
};

/// What AtlasPlan wants to know, by one run through the charts.
std::vector<std::uint32_t> split_parts(LayoutSource& layout);

/// Triangles of a chart that are not counter-clockwise once their texture coordinates are rounded
/// to single precision, as files keep them.
std::uint64_t folded_in_single(const LayoutChart& chart);

/// A layout with its texture coordinates in the atlas; all else as it is (`units` too, which then
/// says how the parts were before).
class AtlasSource : public LayoutSource {
 public:
  /// Both must outlive this.
  AtlasSource(LayoutSource& layout, const AtlasPlan& plan) : layout_(layout), plan_(plan) {}

  LayoutSize size() const override { return layout_.size(); }
  void for_each_vertices(const std::function<void(const LayoutVertices&)>& f) override {
    layout_.for_each_vertices(f);
  }
  void for_each_chart(const std::function<void(const LayoutChart&)>& f) override;

 private:
  LayoutSource& layout_;
  const AtlasPlan& plan_;
};

}  // namespace rattan
