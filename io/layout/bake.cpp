// SPDX-License-Identifier: MIT
#include "io/layout/bake.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
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

  // The triangle of each texel of a band, by how deep in it the texel's centre lies.
  struct Cover {
    std::vector<std::uint32_t> triangle;
    std::vector<double> depth;
  };

  void cover(const BakePart& part, const Band& band, double reach, bool gaps_only,
             Cover& out) const {
    const std::uint32_t width = part.place.side + 1;
    const double x_last = width - 1.0;
    const double y_first = band.y_begin;
    const double y_last = band.y_end - 1.0;
    for (std::uint32_t t = 0; t < part.triangle.size(); ++t) {
      const auto& c = part.triangle[t];
      const Vec2d& p = part.texel[c[0]];
      const Vec2d& q = part.texel[c[1]];
      const Vec2d& r = part.texel[c[2]];
      const double y_lo = std::max(std::ceil(std::min({p.y(), q.y(), r.y()}) - reach), y_first);
      const double y_hi = std::min(std::floor(std::max({p.y(), q.y(), r.y()}) + reach), y_last);
      const double left = part.place.x;
      const double x_lo = std::max(std::ceil(std::min({p.x(), q.x(), r.x()}) - left - reach), 0.0);
      const double x_hi =
          std::min(std::floor(std::max({p.x(), q.x(), r.x()}) - left + reach), x_last);
      if (!(y_lo <= y_hi && x_lo <= x_hi)) {
        continue;
      }
      const FlatTriangle flat(p, q, r);
      if (!flat.valid()) {
        continue;
      }
      for (auto y = static_cast<std::uint32_t>(y_lo); y <= static_cast<std::uint32_t>(y_hi); ++y) {
        for (auto x = static_cast<std::uint32_t>(x_lo); x <= static_cast<std::uint32_t>(x_hi);
             ++x) {
          const double depth = flat.depth(flat.shares(Vec2d(left + x, y)));
          const std::size_t i = std::size_t{y - band.y_begin} * width + x;
          if (depth >= -reach && depth > out.depth[i] &&
              !(gaps_only && out.depth[i] >= -kRounding)) {
            out.depth[i] = depth;
            out.triangle[i] = t;
          }
        }
      }
    }
  }

  BandResult bake_band(const Band& band) {
    const BakePart& part = parts_[band.part];
    const AtlasPart& place = part.place;
    const std::uint32_t width = place.side + 1;
    const std::size_t count = std::size_t{width} * (band.y_end - band.y_begin);
    BandResult result;
    Cover covered{std::vector<std::uint32_t>(count, kNothing),
                  std::vector<double>(count, -std::numeric_limits<double>::infinity())};
    cover(part, band, kRounding, false, covered);
    result.uncovered = static_cast<std::uint64_t>(
        std::count(covered.triangle.begin(), covered.triangle.end(), kNothing));
    if (result.uncovered > 0) {
      cover(part, band, kReach, true, covered);
      fill_gaps(width, covered.triangle);
    }
    Lookup lookup;
    if (texture_ != nullptr) {
      lookup.source.assign(part.triangle.size(), kNothing);
    }
    for (std::uint32_t y = band.y_begin; y < band.y_end; ++y) {
      for (std::uint32_t x = 0; x < width; ++x) {
        const std::uint32_t t = covered.triangle[std::size_t{y - band.y_begin} * width + x];
        const Rgb colour =
            t == kNothing ? Rgb{255, 255, 255} : colour_at(part, t, Vec2d(place.x + x, y), lookup);
        texel(place.x + x, y) = colour;
        for (std::size_t k = 0; k < 3; ++k) {
          result.sum[k] += colour[k];
        }
      }
      fill_margin_beside(place, y);
    }
    result.searched = lookup.searched;
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

  struct Lookup {
    /// One a layout triangle: the textured triangle that holds it, kNothing if not yet asked,
    /// kNoneHolds if there is none.
    std::vector<std::uint32_t> source;
    std::uint32_t last = 0;
    std::uint64_t searched = 0;
  };
  static constexpr std::uint32_t kNoneHolds = kNothing - 1;

  Rgb colour_at(const BakePart& part, std::uint32_t t, const Vec2d& at, Lookup& lookup) const {
    const auto& c = part.triangle[t];
    std::array<double, 3> share =
        FlatTriangle(part.texel[c[0]], part.texel[c[1]], part.texel[c[2]]).shares(at);
    double sum = 0.0;
    for (double& s : share) {
      s = std::max(s, 0.0);
      sum += s;
    }
    std::array<double, 3> colour{};
    if (texture_ == nullptr) {
      for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t i = 0; i < 3; ++i) {
          colour[k] += share[i] / sum * part.colour[c[i]][k];
        }
      }
    } else {
      const Vec3d p = (share[0] * part.position[c[0]] + share[1] * part.position[c[1]] +
                       share[2] * part.position[c[2]]) /
                      sum;
      std::uint32_t source = lookup.source[t];
      if (source == kNothing) {
        source = lookup.source[t] = holder(part, t, lookup);
      }
      if (source == kNoneHolds) {
        source = texture_->nearest(p, lookup.last);
        ++lookup.searched;
      }
      lookup.last = source;
      colour = texture_->colour(source, p);
    }
    Rgb rounded;
    for (std::size_t k = 0; k < 3; ++k) {
      rounded[k] = static_cast<std::uint8_t>(std::lround(std::clamp(colour[k], 0.0, 255.0)));
    }
    return rounded;
  }

  // Layout triangles are pieces of the scan's own, but where repair made something of its own. The
  // one at the middle settles it without doubt, where points on edges lie on two triangles that may
  // be far apart in the picture.
  std::uint32_t holder(const BakePart& part, std::uint32_t t, const Lookup& lookup) const {
    const auto& c = part.triangle[t];
    const Vec3d middle = (part.position[c[0]] + part.position[c[1]] + part.position[c[2]]) / 3.0;
    const std::uint32_t source = texture_->nearest(middle, lookup.last);
    for (const std::uint32_t corner : c) {
      if (!texture_->holds(source, part.position[corner])) {
        return kNoneHolds;
      }
    }
    return source;
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
