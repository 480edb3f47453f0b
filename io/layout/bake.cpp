// SPDX-License-Identifier: MIT
#include "io/layout/bake.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "engine/core/errors.h"
#include "engine/core/parallel.h"

namespace rattan {
namespace {

constexpr std::uint32_t kNothing = std::numeric_limits<std::uint32_t>::max();
/// How far, in texels, a centre may lie outside a triangle by rounding and still be its own; and
/// how far the nearest triangle is looked for where that leaves gaps.
constexpr double kRounding = 1e-6;
constexpr double kReach = 2.0;
/// Charts are gathered until they have so many triangles or texels, then baked side by side, in
/// bands of rows of about so many texels.
constexpr std::size_t kBatchTriangles = std::size_t{1} << 17;
constexpr std::uint64_t kBatchTexels = std::uint64_t{1} << 22;
constexpr std::uint32_t kBandTexels = 1U << 16;

/// A part of a chart, copied out of the stream; corners in texels of the image whose rows come from
/// below, the centre of texel (x, y) at (x, y).
struct BakePart {
  AtlasPart place;
  std::vector<Vec2d> texel;
  std::vector<Vec3d> position;  ///< for textures
  std::vector<Rgba> colour;     ///< for colours
  std::vector<std::array<std::uint32_t, 3>> triangle;
};

struct Band {
  std::uint32_t part;
  std::uint32_t y_begin;  ///< texel rows of the part's square
  std::uint32_t y_end;
};

struct BandResult {
  std::array<std::uint64_t, 3> sum{};
  std::uint64_t uncovered = 0;
  std::uint64_t searched = 0;
};

/// Shares of the three corners at a point, by edges as lines of given slopes.
class FlatTriangle {
 public:
  FlatTriangle(const Vec2d& a, const Vec2d& b, const Vec2d& c) : corner_{a, b, c} {
    const double area2 = (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
    valid_ = area2 > 0.0;
    for (std::size_t k = 0; k < 3 && valid_; ++k) {
      const Vec2d& from = corner_[(k + 1) % 3];
      const Vec2d edge = corner_[(k + 2) % 3] - from;
      normal_[k] = Vec2d(-edge.y(), edge.x()) / area2;
      height_[k] = area2 / edge.norm();
    }
  }
  bool valid() const { return valid_; }
  std::array<double, 3> shares(const Vec2d& p) const {
    std::array<double, 3> s;
    for (std::size_t k = 0; k < 3; ++k) {
      s[k] = normal_[k].dot(p - corner_[(k + 1) % 3]);
    }
    return s;
  }
  /// Texels from p to the nearest side's line; negative outside.
  double depth(const std::array<double, 3>& shares) const {
    return std::min({shares[0] * height_[0], shares[1] * height_[1], shares[2] * height_[2]});
  }

 private:
  std::array<Vec2d, 3> corner_;
  std::array<Vec2d, 3> normal_;
  std::array<double, 3> height_{};
  bool valid_ = false;
};

class Baker {
 public:
  Baker(LayoutSource& atlas, const AtlasPlan& plan, const TexturedScan* texture)
      : atlas_(atlas), plan_(plan), texture_(texture) {
    const int size = static_cast<int>(plan.size());
    baked_.image = Image(size, size);
  }

  BakedImage run(const std::function<void(std::uint32_t)>& progress) {
    atlas_.for_each_chart([&](const LayoutChart& chart) {
      add(chart);
      if (triangles_ >= kBatchTriangles || texels_ >= kBatchTexels) {
        bake_batch();
        if (progress) {
          progress(chart.chart + 1);
        }
      }
    });
    bake_batch();
    fill_free();
    return std::move(baked_);
  }

 private:
  void add(const LayoutChart& chart) {
    const double size = plan_.size();
    for (std::size_t k = 0; k + 1 < chart.part_begin.size(); ++k) {
      BakePart part;
      part.place = plan_.part(chart.first_part + k);
      const std::uint32_t first = chart.part_uv_begin[k];
      const std::uint32_t count = chart.part_uv_begin[k + 1] - first;
      part.texel.reserve(count);
      for (const Vec2d& uv : chart.uv.subspan(first, count)) {
        part.texel.emplace_back(uv.x() * size - 0.5, uv.y() * size - 0.5);
      }
      if (texture_ != nullptr) {
        const auto positions = chart.position.subspan(first, count);
        part.position.assign(positions.begin(), positions.end());
      } else {
        ensure(!chart.colour.empty(), "A layout without colours is not baked without a texture.");
        const auto colours = chart.colour.subspan(first, count);
        part.colour.assign(colours.begin(), colours.end());
      }
      part.triangle.reserve(chart.part_begin[k + 1] - chart.part_begin[k]);
      for (std::uint32_t t = chart.part_begin[k]; t < chart.part_begin[k + 1]; ++t) {
        const auto& c = chart.triangle[t];
        part.triangle.push_back({c[0] - first, c[1] - first, c[2] - first});
      }
      const std::uint32_t side = part.place.side + 1;
      const std::uint32_t rows = std::max(1U, kBandTexels / side);
      for (std::uint32_t y = 0; y < side; y += rows) {
        bands_.push_back({static_cast<std::uint32_t>(parts_.size()), part.place.y + y,
                          part.place.y + std::min(side, y + rows)});
      }
      triangles_ += part.triangle.size();
      texels_ += std::uint64_t{side} * side;
      baked_.texels += std::uint64_t{side} * side;
      parts_.push_back(std::move(part));
    }
  }

  void bake_batch() {
    std::vector<BandResult> results(bands_.size());
    parallel_indices(
        bands_.size(), [&](std::size_t b) { results[b] = bake_band(bands_[b]); }, 1);
    for (const BandResult& r : results) {
      for (std::size_t k = 0; k < 3; ++k) {
        sum_[k] += r.sum[k];
      }
      baked_.uncovered += r.uncovered;
      baked_.searched += r.searched;
    }
    parts_.clear();
    bands_.clear();
    triangles_ = 0;
    texels_ = 0;
  }

  /// The triangle of each texel of a band, by how deep in it the texel's centre lies.
  struct Cover {
    std::vector<std::uint32_t> triangle;
    std::vector<double> depth;
  };

  // f(centre, position in the band) for the band's texels in the triangle's box, widened by reach.
  template <class F>
  static void for_texels(const BakePart& part, std::uint32_t t, const Band& band, double reach,
                         const F& f) {
    const std::uint32_t width = part.place.side + 1;
    const auto& c = part.triangle[t];
    const Vec2d& p = part.texel[c[0]];
    const Vec2d& q = part.texel[c[1]];
    const Vec2d& r = part.texel[c[2]];
    const Vec2d from(part.place.x, band.y_begin);
    const Vec2d to(part.place.x + part.place.side, band.y_end - 1.0);
    const Vec2d lo = p.cwiseMin(q).cwiseMin(r) - Vec2d::Constant(reach);
    const Vec2d hi = p.cwiseMax(q).cwiseMax(r) + Vec2d::Constant(reach);
    const double y_last = std::min(hi.y(), to.y());
    const double x_last = std::min(hi.x(), to.x());
    const double x_first = std::max(std::ceil(lo.x()), from.x());
    for (double y = std::max(std::ceil(lo.y()), from.y()); y <= y_last; y += 1.0) {
      const std::size_t row = static_cast<std::size_t>(y - from.y()) * width;
      for (double x = x_first; x <= x_last; x += 1.0) {
        f(Vec2d(x, y), row + static_cast<std::size_t>(x - from.x()));
      }
    }
  }

  static FlatTriangle flat(const BakePart& part, std::uint32_t t) {
    const auto& c = part.triangle[t];
    return {part.texel[c[0]], part.texel[c[1]], part.texel[c[2]]};
  }

  static void cover(const BakePart& part, const Band& band, double reach, bool gaps_only,
                    Cover& out) {
    for (std::uint32_t t = 0; t < part.triangle.size(); ++t) {
      std::optional<FlatTriangle> corners;
      for_texels(part, t, band, reach, [&](const Vec2d& at, std::size_t i) {
        if (!corners) {
          corners = flat(part, t);
        }
        if (!corners->valid() || (gaps_only && out.depth[i] >= -kRounding)) {
          return;
        }
        const double depth = corners->depth(corners->shares(at));
        if (depth >= -reach && depth > out.depth[i]) {
          out.depth[i] = depth;
          out.triangle[i] = t;
        }
      });
    }
  }

  BandResult bake_band(const Band& band) {
    const BakePart& part = parts_[band.part];
    const AtlasPart& place = part.place;
    const std::uint32_t width = place.side + 1;
    const std::size_t count = std::size_t{width} * (band.y_end - band.y_begin);
    constexpr double kOutside = -std::numeric_limits<double>::infinity();
    BandResult result;
    Cover covered{std::vector<std::uint32_t>(count, kNothing),
                  std::vector<double>(count, kOutside)};
    cover(part, band, kRounding, false, covered);
    result.uncovered = static_cast<std::uint64_t>(
        std::count(covered.triangle.begin(), covered.triangle.end(), kNothing));
    const double reach = result.uncovered > 0 ? kReach : kRounding;
    if (result.uncovered > 0) {
      cover(part, band, kReach, true, covered);
    }
    Lookup lookup;
    for (std::uint32_t t = 0; t < part.triangle.size(); ++t) {
      std::optional<Brush> brush;
      for_texels(part, t, band, reach, [&](const Vec2d& at, std::size_t i) {
        if (covered.triangle[i] == t) {
          if (!brush) {
            brush = brush_of(part, t, lookup);
          }
          texel(at) = paint(*brush, at, lookup);
        }
      });
    }
    if (result.uncovered > 0) {
      fill_gaps(width, covered.triangle);
      for (std::size_t i = 0; i < count; ++i) {
        if (covered.depth[i] == kOutside && covered.triangle[i] != kNothing) {
          const std::size_t row = i / width;
          const Vec2d at(place.x + static_cast<double>(i % width),
                         band.y_begin + static_cast<double>(row));
          texel(at) = paint(brush_of(part, covered.triangle[i], lookup), at, lookup);
        }
      }
    }
    result.searched = lookup.searched;
    for (std::uint32_t y = band.y_begin; y < band.y_end; ++y) {
      for (std::uint32_t x = place.x; x <= place.x + place.side; ++x) {
        for (std::size_t k = 0; k < 3; ++k) {
          result.sum[k] += texel(x, y)[k];
        }
      }
      fill_margin_beside(place, y);
    }
    fill_margin_beyond(place, band);
    return result;
  }

  // What is still empty takes the triangle of a texel beside it: the one before in its row, the one
  // behind, those of the rows before, those of the rows behind.
  static void fill_gaps(std::size_t width, std::vector<std::uint32_t>& triangle) {
    const auto take = [&](std::size_t to, std::size_t from) {
      triangle[to] = triangle[to] == kNothing ? triangle[from] : triangle[to];
    };
    const std::size_t count = triangle.size();
    for (std::size_t i = 1; i < count; ++i) {
      take(i, i % width > 0 ? i - 1 : i);
    }
    for (std::size_t i = count - 1; i-- > 0;) {
      take(i, i % width + 1 < width ? i + 1 : i);
    }
    for (std::size_t i = width; i < count; ++i) {
      take(i, i - width);
    }
    for (std::size_t i = count - width; i-- > 0;) {
      take(i, i + width);
    }
  }

  /// What the colours of one triangle come from.
  struct Brush {
    FlatTriangle flat;
    std::array<Vec3d, 3> position;    ///< of its corners
    std::array<Vec3d, 3> value;       ///< red, green and blue, or texture coordinates
    std::uint32_t source = kNothing;  ///< the textured triangle that holds all of it
  };
  struct Lookup {
    std::uint32_t last = 0;
    std::uint64_t searched = 0;
  };

  // Layout triangles are pieces of the scan's own, but where repair made something of its own. The
  // one at the middle settles it without doubt, where points on edges lie on two triangles that may
  // be far apart in the picture.
  Brush brush_of(const BakePart& part, std::uint32_t t, Lookup& lookup) const {
    const auto& c = part.triangle[t];
    Brush brush{flat(part, t), {}, {}, kNothing};
    if (texture_ == nullptr) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Rgba& colour = part.colour[c[k]];
        brush.value[k] = Vec3d(colour[0], colour[1], colour[2]);
      }
      return brush;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      brush.position[k] = part.position[c[k]];
    }
    const Vec3d middle = (brush.position[0] + brush.position[1] + brush.position[2]) / 3.0;
    const std::uint32_t source = lookup.last = texture_->nearest(middle, lookup.last);
    if (std::all_of(brush.position.begin(), brush.position.end(),
                    [&](const Vec3d& p) { return texture_->holds(source, p); })) {
      brush.source = source;
      for (std::size_t k = 0; k < 3; ++k) {
        brush.value[k] << texture_->texture(source, brush.position[k]), 0.0;
      }
    }
    return brush;
  }

  Rgb paint(const Brush& brush, const Vec2d& at, Lookup& lookup) const {
    std::array<double, 3> share = brush.flat.shares(at);
    double sum = 0.0;
    for (double& s : share) {
      s = std::max(s, 0.0);
      sum += s;
    }
    const auto between = [&](const std::array<Vec3d, 3>& corner) -> Vec3d {
      return (share[0] * corner[0] + share[1] * corner[1] + share[2] * corner[2]) / sum;
    };
    std::array<double, 3> colour;
    if (texture_ == nullptr) {
      const Vec3d c = between(brush.value);
      colour = {c.x(), c.y(), c.z()};
    } else if (brush.source != kNothing) {
      colour = texture_->colour(brush.source, between(brush.value).head<2>());
    } else {
      const Vec3d p = between(brush.position);
      lookup.last = texture_->nearest(p, lookup.last);
      ++lookup.searched;
      colour = texture_->colour(lookup.last, texture_->texture(lookup.last, p));
    }
    Rgb rounded;
    for (std::size_t k = 0; k < 3; ++k) {
      rounded[k] = static_cast<std::uint8_t>(std::lround(std::clamp(colour[k], 0.0, 255.0)));
    }
    return rounded;
  }

  Rgb& texel(const Vec2d& at) {
    return texel(static_cast<std::uint32_t>(at.x()), static_cast<std::uint32_t>(at.y()));
  }
  Rgb& texel(std::uint32_t x, std::uint32_t y) {
    return baked_.image.at(static_cast<int>(x), static_cast<int>(plan_.size() - 1 - y));
  }
  void fill_margin_beside(const AtlasPart& place, std::uint32_t y) {
    for (std::uint32_t x = place.x_begin; x < place.x; ++x) {
      texel(x, y) = texel(place.x, y);
    }
    for (std::uint32_t x = place.x + place.side + 1; x < place.x_end; ++x) {
      texel(x, y) = texel(place.x + place.side, y);
    }
  }
  // Below the first band and above the last one.
  void fill_margin_beyond(const AtlasPart& place, const Band& band) {
    const auto repeat = [&](std::uint32_t from, std::uint32_t to) {
      std::copy_n(&texel(place.x_begin, from), place.x_end - place.x_begin,
                  &texel(place.x_begin, to));
    };
    for (std::uint32_t y = place.y_begin; band.y_begin == place.y && y < place.y; ++y) {
      repeat(place.y, y);
    }
    const std::uint32_t last = place.y + place.side;
    for (std::uint32_t y = last + 1; band.y_end == last + 1 && y < place.y_end; ++y) {
      repeat(last, y);
    }
  }

  void fill_free() {
    Rgb mean{255, 255, 255};
    for (std::size_t k = 0; k < 3 && baked_.texels > 0; ++k) {
      mean[k] = static_cast<std::uint8_t>((sum_[k] + baked_.texels / 2) / baked_.texels);
    }
    for (const AtlasPart& place : plan_.free()) {
      for (std::uint32_t y = place.y_begin; y < place.y_end; ++y) {
        std::fill_n(&texel(place.x_begin, y), place.x_end - place.x_begin, mean);
      }
    }
  }

  LayoutSource& atlas_;
  const AtlasPlan& plan_;
  const TexturedScan* texture_;
  BakedImage baked_;
  std::array<std::uint64_t, 3> sum_{};
  std::vector<BakePart> parts_;
  std::vector<Band> bands_;
  std::size_t triangles_ = 0;
  std::uint64_t texels_ = 0;
};

}  // namespace

bool bakes_textures(const std::string& scan, const TextureOutline& outline, bool has_colours) {
  if (outline.textured == 0 && !has_colours) {
    throw UsageError(
        scan +
        " has no colours to bake: neither vertex colours nor textures (an OBJ file with "
        "vt, usemtl and a material file with map_Kd, or a PLY file with texture "
        "coordinates and a comment TextureFile). Leave out the baked image.");
  }
  return outline.textured > 0;
}

std::uint64_t bake_bytes(std::uint32_t image_size) {
  // A texture vertex has a triangle or two: about 100 bytes a triangle. The largest chart comes on
  // top of a batch that is nearly full.
  constexpr std::uint64_t kWork = std::uint64_t{48} << 20;
  return std::uint64_t{image_size} * image_size * sizeof(Rgb) + kWork;
}

BakedImage bake(LayoutSource& atlas, const AtlasPlan& plan, const TexturedScan* texture,
                const std::function<void(std::uint32_t)>& progress) {
  return Baker(atlas, plan, texture).run(progress);
}

}  // namespace rattan
