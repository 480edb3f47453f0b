// SPDX-License-Identifier: MIT
#include "engine/layout/atlas.h"

#include <algorithm>
#include <bit>
#include <string>
#include <utility>

#include "engine/core/errors.h"

namespace rattan {
namespace {

/// Texels of an atlas without an image. A power of two, so that corners of parts are exact in
/// single precision.
constexpr std::uint32_t kFineGrid = 1U << 20;
constexpr std::uint32_t kGuttersToSide = 1024;
constexpr std::uint32_t kGuttersToCell = 8;

/// The cells of a grid along the Hilbert curve of the power of two that covers it; those outside
/// are skipped.
class GridCurve {
 public:
  GridCurve(std::uint32_t columns, std::uint32_t rows)
      : columns_(columns), rows_(rows), side_(std::bit_ceil(std::max(columns, rows))) {}

  std::pair<std::uint32_t, std::uint32_t> next() {
    for (;;) {
      const auto [x, y] = at(index_++);
      if (x < columns_ && y < rows_) {
        return {x, y};
      }
    }
  }

 private:
  // From the two lowest bits up: a quadrant each, in which the curve so far is turned.
  std::pair<std::uint32_t, std::uint32_t> at(std::uint64_t index) const {
    std::uint32_t x = 0;
    std::uint32_t y = 0;
    for (std::uint32_t s = 1; s < side_; s *= 2, index >>= 2) {
      const auto quadrant = static_cast<std::uint32_t>(index & 3);
      if (quadrant == 0) {
        std::swap(x, y);
      } else if (quadrant == 3) {
        const std::uint32_t turned = s - 1 - y;
        y = s - 1 - x;
        x = turned + s;
      } else {
        x += quadrant == 2 ? s : 0;
        y += s;
      }
    }
    return {x, y};
  }

  std::uint32_t columns_;
  std::uint32_t rows_;
  std::uint32_t side_;
  std::uint64_t index_ = 0;
};

std::uint32_t square_side(std::uint64_t cells) {
  std::uint64_t side = 1;
  while (side * side < cells) {
    ++side;
  }
  return static_cast<std::uint32_t>(side);
}

/// Where the i-th of n even shares of `size` begins.
std::uint32_t share_begin(std::uint32_t i, std::uint32_t n, std::uint32_t size) {
  return static_cast<std::uint32_t>(std::uint64_t{i} * size / n);
}

}  // namespace

AtlasPlan::AtlasPlan(const LayoutSize& size, std::span<const std::uint32_t> split_parts,
                     const AtlasOptions& options)
    : units_(size.units), size_(options.image_size == 0 ? kFineGrid : options.image_size) {
  ensure(split_parts.size() == size.charts, "An atlas knows the parts of every chart.");
  std::uint64_t whole = 0;
  std::uint64_t split = 0;
  for (const std::uint32_t n : split_parts) {
    (n == 0 ? whole : split) += std::max(n, 1U);
  }
  ensure(whole + split == size.parts, "An atlas knows every part.");
  const std::uint64_t used = std::max<std::uint64_t>(1, whole + (split + 3) / 4);
  columns_ = square_side(used);
  rows_ = static_cast<std::uint32_t>((used + columns_ - 1) / columns_);
  const std::uint32_t cell = size_ / columns_;
  gutter_ = std::max(1U, options.image_size != 0
                             ? options.gutter
                             : std::min(kFineGrid / kGuttersToSide, cell / kGuttersToCell));
  const std::uint64_t least_cell = (split > 0 ? 2 : 1) * (std::uint64_t{gutter_} + 1);
  if (cell < least_cell) {
    throw UsageError("An image of " + std::to_string(size_) + " x " + std::to_string(size_) +
                     " texels is too small for " + std::to_string(size.charts) +
                     " charts with gutters of " + std::to_string(gutter_) + " texels: it takes " +
                     std::to_string(least_cell * columns_) + ", better four times as many.");
  }
  whole_side_ = cell - gutter_;
  split_side_ = split > 0 ? cell / 2 - gutter_ : 0;
  const auto area = [&](std::uint64_t count, std::uint32_t side) {
    return static_cast<double>(count) * side / size_ * side / size_;
  };
  efficiency_ = area(whole, whole_side_) + area(split, split_side_);

  cells_.reserve(size.parts);
  GridCurve curve(columns_, rows_);
  Cell open;  // the cell whose quarters are being filled
  open.quarter = 3;
  const auto take = [&] {
    const auto [x, y] = curve.next();
    Cell c;
    c.column = x;
    c.row = y & 0x1fffffffU;
    return c;
  };
  for (const std::uint32_t n : split_parts) {
    if (n == 0) {
      cells_.push_back(take());
    }
    for (std::uint32_t i = 0; i < n; ++i) {
      if (open.quarter == 3) {
        open = take();
        open.quarter = 0;
      } else {
        open.quarter = (open.quarter + 1) & 3;
      }
      cells_.push_back(open);
    }
  }
  for (std::uint64_t left = std::uint64_t{columns_} * rows_ - used; left > 0; --left) {
    free_.push_back(take());
  }
  while (split > 0 && open.quarter != 3) {
    open.quarter = (open.quarter + 1) & 3;
    free_.push_back(open);
  }
}

AtlasPart AtlasPlan::part(std::uint64_t number) const {
  return place(cells_[number]);
}

std::vector<AtlasPart> AtlasPlan::free() const {
  std::vector<AtlasPart> places;
  places.reserve(free_.size());
  for (const Cell& c : free_) {
    places.push_back(place(c));
  }
  return places;
}

std::uint32_t AtlasPlan::bits(std::uint32_t unit_bits) const {
  double least_unit = static_cast<double>(whole_side_) / units_ / size_;
  if (split_side_ > 0) {
    least_unit = std::min(least_unit, static_cast<double>(split_side_) / size_);
  }
  std::uint32_t bits = unit_bits;
  for (; least_unit < 1.0; least_unit *= 2.0) {
    ++bits;
  }
  return bits;
}

AtlasPart AtlasPlan::place(const Cell& c) const {
  AtlasPart p;
  p.x_begin = share_begin(c.column, columns_, size_);
  p.x_end = share_begin(c.column + 1, columns_, size_);
  p.y_begin = share_begin(c.row, rows_, size_);
  p.y_end = share_begin(c.row + 1, rows_, size_);
  p.side = whole_side_;
  if (c.quarter != kWhole) {
    const std::uint32_t x_middle = p.x_begin + (p.x_end - p.x_begin) / 2;
    const std::uint32_t y_middle = p.y_begin + (p.y_end - p.y_begin) / 2;
    ((c.quarter & 1) != 0 ? p.x_begin : p.x_end) = x_middle;
    ((c.quarter & 2) != 0 ? p.y_begin : p.y_end) = y_middle;
    p.side = split_side_;
  }
  p.x = p.x_begin + gutter_ / 2;
  p.y = p.y_begin + gutter_ / 2;
  return p;
}

AtlasMap AtlasPlan::map(std::uint64_t number) const {
  const AtlasPart p = part(number);
  const double units = cells_[number].quarter == kWhole ? units_ : 1.0;
  return {Vec2d(p.x + 0.5, p.y + 0.5) / size_, p.side / (units * size_)};
}

std::vector<std::uint32_t> split_parts(LayoutSource& layout) {
  std::vector<std::uint32_t> parts;
  parts.reserve(layout.size().charts);
  layout.for_each_chart([&](const LayoutChart& chart) {
    parts.push_back(chart.kind == ChartKind::kSplit
                        ? static_cast<std::uint32_t>(chart.part_begin.size() - 1)
                        : 0);
  });
  return parts;
}

std::uint64_t folded_in_single(const LayoutChart& chart) {
  const auto rounded = [&](std::uint32_t v) {
    return Vec2d(static_cast<float>(chart.uv[v].x()), static_cast<float>(chart.uv[v].y()));
  };
  std::uint64_t folded = 0;
  for (const auto& t : chart.triangle) {
    const Vec2d a = rounded(t[0]);
    const Vec2d ab = rounded(t[1]) - a;
    const Vec2d ac = rounded(t[2]) - a;
    folded += ab.x() * ac.y() > ab.y() * ac.x() ? 0 : 1;
  }
  return folded;
}

void AtlasSource::for_each_chart(const std::function<void(const LayoutChart&)>& f) {
  std::vector<Vec2d> uv;
  layout_.for_each_chart([&](const LayoutChart& chart) {
    uv.assign(chart.uv.begin(), chart.uv.end());
    for (std::size_t k = 0; k + 1 < chart.part_uv_begin.size(); ++k) {
      const AtlasMap map = plan_.map(chart.first_part + k);
      for (std::size_t i = chart.part_uv_begin[k]; i < chart.part_uv_begin[k + 1]; ++i) {
        uv[i] = map.origin + map.scale * uv[i];
      }
    }
    LayoutChart mapped = chart;
    mapped.uv = uv;
    f(mapped);
  });
}

}  // namespace rattan
