// SPDX-License-Identifier: MIT
// Evenly spaced streamlines in the picture plane, after Jobard and Lefer, "Creating evenly-spaced
// streamlines of arbitrary density", 1997; here for a field of crosses: a line keeps its distance
// only from lines that run its own way.
#include "io/picture/field_lines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace rattan {
namespace {

using Vec2f = Eigen::Vector2f;

constexpr float kStep = 0.75F;        // pixels
constexpr float kStopShare = 0.55F;   // of the spacing: a line ends this near to another
constexpr float kParallel = 0.75F;    // cosine from which two lines run the same way
constexpr float kLeastSlope = 0.22F;  // foreshortening beyond which a direction is not followed
constexpr float kLongest = 220.0F;    // pixels each way

struct Seed {
  Vec2f at;
  Vec2f heading;
};

class Tracer {
 public:
  Tracer(const SampleGrid& grid, const std::vector<Vec3f>& directions, const Camera& camera,
         float spacing)
      : width_(grid.width), height_(grid.height), spacing_(spacing) {
    const std::size_t pixels = directions.size();
    crosses_.assign(pixels, {Vec2f::Zero(), Vec2f::Zero()});
    depth_.assign(pixels, std::numeric_limits<float>::infinity());
    const float scale =
        camera.project({1.0F, 0.0F, 1.0F}).x() - camera.project({0.0F, 0.0F, 1.0F}).x();
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        const std::size_t i = pixel(x, y);
        const std::size_t sample = grid.middle(x, y);
        const Vec3f& a = directions[i];
        if (a.isZero(0.0F) || !std::isfinite(grid.depth[sample])) {
          continue;
        }
        depth_[i] = grid.depth[sample];
        pixel_size_ = std::max(pixel_size_, depth_[i] / scale);
        const Vec3f ray = camera.ray(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F);
        const Vec3f b = grid.normal(sample).cross(a);
        crosses_[i] = {on_screen(a, ray), on_screen(b, ray)};
      }
    }
    cells_wide_ = static_cast<int>(static_cast<float>(width_) / spacing_) + 2;
    cells_tall_ = static_cast<int>(static_cast<float>(height_) / spacing_) + 2;
    cells_.resize(static_cast<std::size_t>(cells_wide_) * static_cast<std::size_t>(cells_tall_));
  }

  std::vector<std::vector<Vec2f>> run() {
    std::vector<std::vector<Vec2f>> lines;
    std::deque<Seed> seeds;
    const auto stride = std::max(1, static_cast<int>(spacing_ * 0.5F));
    for (int y = stride / 2; y < height_; y += stride) {
      for (int x = stride / 2; x < width_; x += stride) {
        for (const Vec2f& heading : crosses_[pixel(x, y)]) {
          seeds.push_back({{static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F}, heading});
          // Neighbours of a new line come before the next point of the grid: that is what spaces
          // lines evenly.
          while (!seeds.empty()) {
            const Seed seed = seeds.front();
            seeds.pop_front();
            grow(seed, lines, seeds);
          }
        }
      }
    }
    return lines;
  }

 private:
  std::size_t pixel(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }
  static Vec2f on_screen(const Vec3f& d, const Vec3f& ray) {
    return {d.x() - ray.x() * d.z(), -(d.y() - ray.y() * d.z())};
  }

  /// Unit direction of the field at p nearest to `heading`; zero where there is none.
  Vec2f follow(const Vec2f& p, const Vec2f& heading, float& depth) const {
    const int x = static_cast<int>(std::floor(p.x()));
    const int y = static_cast<int>(std::floor(p.y()));
    if (x < 1 || y < 1 || x >= width_ - 1 || y >= height_ - 1 ||
        !std::isfinite(depth_[pixel(x, y)])) {
      return Vec2f::Zero();
    }
    depth = depth_[pixel(x, y)];
    const float fx = p.x() - 0.5F;
    const float fy = p.y() - 0.5F;
    const int x0 = static_cast<int>(std::floor(fx));
    const int y0 = static_cast<int>(std::floor(fy));
    Vec2f sum = Vec2f::Zero();
    for (int j = 0; j < 2; ++j) {
      for (int i = 0; i < 2; ++i) {
        const float w =
            (i == 0 ? 1.0F - (fx - static_cast<float>(x0)) : fx - static_cast<float>(x0)) *
            (j == 0 ? 1.0F - (fy - static_cast<float>(y0)) : fy - static_cast<float>(y0));
        const auto& cross = crosses_[pixel(x0 + i, y0 + j)];
        Vec2f best = Vec2f::Zero();
        float best_cos = -1.0F;
        for (const Vec2f& d : cross) {
          const float length = d.norm();
          if (length < kLeastSlope) {
            continue;
          }
          const float c = d.dot(heading) / length;
          if (std::abs(c) > best_cos) {
            best_cos = std::abs(c);
            best = d * ((c < 0.0F ? -1.0F : 1.0F) / length);
          }
        }
        sum += w * best;
      }
    }
    const float length = sum.norm();
    if (length < 0.5F || sum.dot(heading) < 0.6F * length) {
      return Vec2f::Zero();
    }
    return sum / length;
  }

  bool crowded(const Vec2f& p, const Vec2f& heading, float distance) const {
    const int cx = static_cast<int>(p.x() / spacing_);
    const int cy = static_cast<int>(p.y() / spacing_);
    for (int j = std::max(0, cy - 1); j <= std::min(cells_tall_ - 1, cy + 1); ++j) {
      for (int i = std::max(0, cx - 1); i <= std::min(cells_wide_ - 1, cx + 1); ++i) {
        for (const Seed& other : cells_[cell(i, j)]) {
          if ((other.at - p).squaredNorm() < distance * distance &&
              std::abs(other.heading.dot(heading)) > kParallel) {
            return true;
          }
        }
      }
    }
    return false;
  }

  std::size_t cell(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(cells_wide_) +
           static_cast<std::size_t>(i);
  }

  void extend(Vec2f p, Vec2f heading, std::vector<Seed>& path) const {
    float before = 0.0F;
    for (float length = 0.0F; length < kLongest; length += kStep) {
      float depth = 0.0F;
      const Vec2f d = follow(p, heading, depth);
      if (d.isZero(0.0F) || (length > 0.0F && std::abs(depth - before) > 6.0F * pixel_size_) ||
          crowded(p, d, length == 0.0F ? spacing_ * 0.98F : spacing_ * kStopShare)) {
        return;
      }
      path.push_back({p, d});
      before = depth;
      heading = d;
      p += kStep * d;
    }
  }

  void grow(const Seed& seed, std::vector<std::vector<Vec2f>>& lines, std::deque<Seed>& seeds) {
    const float norm = seed.heading.norm();
    if (norm < kLeastSlope) {
      return;
    }
    const Vec2f heading = seed.heading / norm;
    std::vector<Seed> forward;
    std::vector<Seed> back;
    extend(seed.at, heading, forward);
    if (forward.empty()) {
      return;
    }
    extend(seed.at, -heading, back);
    std::reverse(back.begin(), back.end());
    if (!back.empty()) {
      back.pop_back();  // the seed itself
    }
    back.insert(back.end(), forward.begin(), forward.end());
    if (static_cast<float>(back.size()) * kStep < 2.0F * spacing_) {
      return;
    }
    std::vector<Vec2f> line;
    const auto apart = static_cast<std::size_t>(spacing_ / kStep);
    for (std::size_t i = 0; i < back.size(); ++i) {
      const Seed& s = back[i];
      line.push_back(s.at);
      cells_[cell(static_cast<int>(s.at.x() / spacing_), static_cast<int>(s.at.y() / spacing_))]
          .push_back(s);
      if (i % apart == apart / 2) {
        const Vec2f side = spacing_ * Vec2f(-s.heading.y(), s.heading.x());
        seeds.push_back({s.at + side, s.heading});
        seeds.push_back({s.at - side, s.heading});
      }
    }
    lines.push_back(std::move(line));
  }

  int width_, height_;
  float spacing_;
  float pixel_size_ = 0.0F;  // a length of the scan, where the surface is farthest
  int cells_wide_ = 0, cells_tall_ = 0;
  std::vector<std::array<Vec2f, 2>> crosses_;
  std::vector<float> depth_;
  std::vector<std::vector<Seed>> cells_;
};

}  // namespace

std::vector<float> trace_field_lines(const SampleGrid& grid, const std::vector<Vec3f>& directions,
                                     const Camera& camera, float spacing, float width) {
  std::vector<float> opacity(
      static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height), 0.0F);
  if (directions.empty()) {
    return opacity;
  }
  for (const auto& line : Tracer(grid, directions, camera, spacing).run()) {
    for (std::size_t i = 0; i < line.size(); ++i) {
      // Ends taper off.
      const auto from_end = static_cast<float>(std::min(i, line.size() - 1 - i)) * kStep;
      const float w = width * std::min(1.0F, 0.35F + from_end / spacing);
      const float reach = 0.5F * w + 0.5F;
      const Vec2f& p = line[i];
      for (int y = static_cast<int>(p.y() - reach); y <= static_cast<int>(p.y() + reach); ++y) {
        for (int x = static_cast<int>(p.x() - reach); x <= static_cast<int>(p.x() + reach); ++x) {
          if (x < 0 || y < 0 || x >= grid.width || y >= grid.height) {
            continue;
          }
          const Vec2f centre(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F);
          float& o = opacity[static_cast<std::size_t>(y) * static_cast<std::size_t>(grid.width) +
                             static_cast<std::size_t>(x)];
          o = std::max(o, std::clamp(reach - (centre - p).norm(), 0.0F, 1.0F));
        }
      }
    }
  }
  return opacity;
}

}  // namespace rattan
