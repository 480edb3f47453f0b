// SPDX-License-Identifier: MIT
#include "engine/layout/disk_sides.h"
#include "engine/layout/flat_disk.h"

namespace rattan::layout {
namespace {

/// What is asked of a star's triangles when one is too thin; one that has it is left alone.
constexpr double kWanted = 2 * kLeastThickness;
constexpr int kPasses = 30;
/// Room is made around so many triangles at most; where more are thin, the whole map is bad.
constexpr std::size_t kMostWithRoom = 64;
/// And nothing is moved where more than so many are thin, or this share of all.
constexpr std::size_t kMostThin = 64;
constexpr std::size_t kMostThinShare = 8;
/// Passes that may leave as many thin triangles as there were before.
constexpr int kFruitless = 3;
/// Passes that move no further than needed; later ones look for all the room there is.
constexpr int kShyPasses = 6;
/// Thicknesses tried for the roomiest place: from far below the floor by doubling, then finer.
constexpr int kTries = 36;

using Edge = std::array<Vec2d, 2>;

double least_thickness(const std::vector<Edge>& star, const Vec2d& x) {
  double least = thickness(star[0][0], star[0][1], x);
  for (const Edge& e : star) {
    least = std::min(least, thickness(e[0], e[1], x));
  }
  return least;
}

/// Where a vertex may be so that its triangles are thick enough, their girths taken as they are
/// with the vertex at x: a convex polygon, perhaps none.
void clip_to_star(const std::vector<Edge>& star, const Vec2d& x, double wanted,
                  std::vector<Vec2d>& polygon, std::vector<Vec2d>& spare) {
  Vec2d low = star[0][0];
  Vec2d high = low;
  for (const Edge& e : star) {
    for (const Vec2d& p : e) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
  }
  polygon = {low, {high.x(), low.y()}, high, {low.x(), high.y()}};
  for (const Edge& e : star) {
    const double least = wanted * girth(e[0], e[1], x);
    spare.clear();
    const auto room = [&](const Vec2d& p) { return doubled_area(e[0], e[1], p) - least; };
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vec2d& p = polygon[i];
      const Vec2d& q = polygon[i + 1 == polygon.size() ? 0 : i + 1];
      const double rp = room(p);
      const double rq = room(q);
      if (rp >= 0) {
        spare.push_back(p);
      }
      if ((rp < 0) != (rq < 0)) {
        spare.push_back(p + rp / (rp - rq) * (q - p));
      }
    }
    polygon.swap(spare);
    if (polygon.empty()) {
      return;
    }
  }
}

Vec2d centre_of(const std::vector<Vec2d>& polygon) {
  Vec2d sum = Vec2d::Zero();
  for (const Vec2d& p : polygon) {
    sum += p;
  }
  return sum / static_cast<double>(polygon.size());
}

Vec2d nearest_in(const std::vector<Vec2d>& polygon, const Vec2d& x) {
  Vec2d best = polygon[0];
  double least = -1;
  bool inside = polygon.size() > 2;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2d& p = polygon[i];
    const Vec2d d = polygon[i + 1 == polygon.size() ? 0 : i + 1] - p;
    inside = inside && d.x() * (x - p).y() - d.y() * (x - p).x() >= 0;
    const double length = d.squaredNorm();
    const double share = length > 0 ? std::clamp((x - p).dot(d) / length, 0.0, 1.0) : 0;
    const Vec2d q = p + share * d;
    const double away = (x - q).squaredNorm();
    if (least < 0 || away < least) {
      least = away;
      best = q;
    }
  }
  return inside ? x : best;
}

class Nudger {
 public:
  explicit Nudger(FlatDisk& disk) : disk_(disk), moved_(disk.position.size(), 0) {
    begin_.assign(disk.position.size() + 2, 0);
    for (const auto& t : disk.triangle) {
      for (const std::uint32_t v : t) {
        ++begin_[v + 2];
      }
    }
    for (std::size_t v = 2; v < begin_.size(); ++v) {
      begin_[v] += begin_[v - 1];
    }
    corner_.resize(3 * disk.triangle.size());
    for (std::uint32_t s = 0; s < corner_.size(); ++s) {
      corner_[begin_[disk.triangle[s / 3][s % 3] + 1]++] = s;
    }
  }

  /// True if something was moved. `bad`: the triangles that were too thin.
  bool pass(const std::vector<std::uint32_t>& bad, bool shy) {
    bool any = false;
    for (const std::uint32_t t : bad) {
      for (const std::uint32_t v : disk_.triangle[t]) {
        if (thickness(disk_, t) < kLeastThickness) {
          any = move(v, shy) || any;
        }
      }
      if (!shy && bad.size() <= kMostWithRoom && thickness(disk_, t) < kLeastThickness) {
        any = make_room(t) || any;
      }
    }
    return any;
  }
  std::uint32_t moved() const {
    return static_cast<std::uint32_t>(std::count(moved_.begin(), moved_.end(), 1));
  }

 private:
  /// Moves the vertices around a triangle that its own corners can't mend.
  bool make_room(std::uint32_t t) {
    bool any = false;
    for (const std::uint32_t v : disk_.triangle[t]) {
      for (std::uint32_t i = begin_[v]; i < begin_[v + 1]; ++i) {
        any = move(disk_.triangle[corner_[i] / 3][next_side(corner_[i]) % 3], false) || any;
        any = move(disk_.triangle[corner_[i] / 3][previous_side(corner_[i]) % 3], false) || any;
      }
    }
    return any;
  }

  /// True if the thinnest triangle around v is thicker now.
  bool move(std::uint32_t v, bool shy) {
    if (disk_.fixed[v] != 0) {
      return false;
    }
    star_.clear();
    for (std::uint32_t i = begin_[v]; i < begin_[v + 1]; ++i) {
      const std::uint32_t s = corner_[i];
      star_.push_back({disk_.uv[disk_.triangle[s / 3][next_side(s) % 3]],
                       disk_.uv[disk_.triangle[s / 3][previous_side(s) % 3]]});
    }
    const Vec2d old = disk_.uv[v];
    const double before = least_thickness(star_, old);
    Vec2d best = old;
    double most = before;
    const auto offer = [&](const Vec2d& x) {
      const double has = least_thickness(star_, x);
      if (has > most) {
        most = has;
        best = x;
      }
    };
    if (shy) {
      Vec2d x = old;
      for (int i = 0; i < 4 && most < kLeastThickness; ++i) {
        clip_to_star(star_, x, kWanted, polygon_, spare_);
        if (polygon_.empty()) {
          break;
        }
        x = nearest_in(polygon_, old);
        offer(x);
      }
    }
    if (!shy || most < kLeastThickness) {
      // The roomiest place, by trying ever thicker triangles.
      Vec2d x = Vec2d::Zero();
      for (const Edge& e : star_) {
        x += e[0] / static_cast<double>(star_.size());
      }
      double has_room = kLeastThickness / (1 << 20);
      double factor = 2;
      for (int i = 0; i < kTries; ++i) {
        clip_to_star(star_, x, factor * has_room, polygon_, spare_);
        if (polygon_.empty()) {
          factor = std::sqrt(factor);
        } else {
          has_room *= factor;
          x = centre_of(polygon_);
          offer(x);
        }
      }
    }
    if (!(most > before)) {
      return false;
    }
    disk_.uv[v] = best;
    moved_[v] = 1;
    return true;
  }

  FlatDisk& disk_;
  std::vector<std::uint8_t> moved_;
  std::vector<std::uint32_t> begin_;
  std::vector<std::uint32_t> corner_;
  std::vector<Edge> star_;
  std::vector<Vec2d> polygon_;
  std::vector<Vec2d> spare_;
};

}  // namespace

std::uint32_t nudge_thin(FlatDisk& disk) {
  std::vector<std::uint32_t> bad;
  const auto find_bad = [&] {
    bad.clear();
    for (std::uint32_t t = 0; t < disk.triangle.size(); ++t) {
      if (!(thickness(disk, t) >= kLeastThickness)) {
        bad.push_back(t);
      }
    }
    return !bad.empty();
  };
  if (!find_bad() || bad.size() > std::max(kMostThin, disk.triangle.size() / kMostThinShare)) {
    return 0;
  }
  Nudger nudger(disk);
  int fruitless = 0;
  for (int pass = 0; pass < kPasses; ++pass) {
    const std::size_t before = bad.size();
    const bool any = nudger.pass(bad, pass < kShyPasses);
    if (!find_bad()) {
      break;
    }
    fruitless = bad.size() < before ? 0 : fruitless + 1;
    if ((!any || fruitless >= kFruitless) && pass >= kShyPasses) {
      break;
    }
    if (!any || fruitless >= kFruitless) {
      pass = kShyPasses - 1;
      fruitless = 0;
    }
  }
  return nudger.moved();
}

}  // namespace rattan::layout
