// SPDX-License-Identifier: MIT
#include "engine/remesh/pair_triangles.h"

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "engine/core/parallel.h"
#include "engine/remesh/split_cells.h"
#include "engine/remesh/split_polygon.h"

namespace rattan {
namespace {

constexpr std::uint32_t kMaxBetween = 8;
constexpr std::size_t kGrain = 16;
/// Distortion counts by this much: the vertices will be moved afterwards, which takes about half of
/// it away.
constexpr double kRelaxed = 0.5;
/// What a new vertex on the boundary costs: its edges are short.
constexpr double kBorderVertex = 0.4;
/// Draws a diagonal to that vertex.
constexpr double kBorderDiagonal = 2.0;
constexpr std::uint32_t kNone = CellMap::kNone;

struct Strip {
  std::uint32_t first = 0;                             ///< the triangle it starts from
  std::uint32_t count = 0;                             ///< edges crossed
  std::array<std::uint32_t, kMaxBetween + 1> cross{};  ///< half-edges, in the face that is left
};

struct Candidate {
  double gain = 0;
  Strip strip;
  /// Half-edges around the union. If the strip ends at the boundary, kNone stands for the second
  /// half of the boundary edge `border` after its division.
  std::vector<std::uint32_t> ring;
  std::uint32_t border = kNone;
  PolygonSplit split;
};

/// Finds strips and values them; one a thread.
class Finder {
 public:
  Finder(const CellMap& map, std::uint32_t between, bool to_border, bool firm_curves)
      : map_(map), between_(between), to_border_(to_border), firm_curves_(firm_curves) {}

  /// The best strip from the triangle over `between` quads to a triangle of higher id, or to the
  /// boundary; its count stays zero if none gains.
  void search(std::uint32_t triangle, Candidate& best) {
    strip_.first = triangle;
    strip_.count = 0;
    path_[0] = triangle;
    step(triangle, CellMap::kNone, best);
  }

 private:
  void step(std::uint32_t face, std::uint32_t entry, Candidate& best) {
    const std::uint32_t start = map_.face_half(face);
    std::uint32_t h = start;
    do {
      const std::uint32_t g = map_.face(CellMap::twin(h));
      if (map_.is_hole(g)) {
        if (to_border_ && strip_.count == between_) {
          border_ = h;
          value(best);
          border_ = kNone;
        }
      } else if (h != entry && !map_.is_feature(h) &&
                 std::find(path_.begin(), path_.begin() + strip_.count + 1, g) ==
                     path_.begin() + strip_.count + 1) {
        strip_.cross[strip_.count] = h;
        if (strip_.count == between_) {
          if (!to_border_ && map_.degree(g) == 3 && g > strip_.first) {
            ++strip_.count;
            path_[strip_.count] = g;
            value(best);
            --strip_.count;
          }
        } else if (map_.degree(g) == 4) {
          ++strip_.count;
          path_[strip_.count] = g;
          step(g, CellMap::twin(h), best);
          --strip_.count;
        }
      }
      h = map_.next(h);
    } while (h != start);
  }

  bool crossed(std::uint32_t h) const {
    for (std::uint32_t k = 0; k < strip_.count; ++k) {
      if ((strip_.cross[k] | 1U) == (h | 1U)) {
        return true;
      }
    }
    return false;
  }

  void value(Candidate& best) {
    ring_.clear();
    std::uint32_t h = map_.face_half(strip_.first);
    while (crossed(h)) {
      h = map_.next(h);
    }
    const std::uint32_t start = h;
    do {
      ring_.push_back(h);
      h = map_.next(h);
      while (crossed(h)) {
        h = map_.next(CellMap::twin(h));
      }
    } while (h != start);
    ids_.clear();
    for (const std::uint32_t r : ring_) {
      ids_.push_back(map_.origin(r));
    }
    std::sort(ids_.begin(), ids_.end());
    if (std::adjacent_find(ids_.begin(), ids_.end()) != ids_.end()) {
      return;
    }
    // Both sides without what triangles cost as such.
    const double triangles = PolygonSplitter::kTriangle * (to_border_ ? 1 : 2);
    double old_shape = -triangles;
    for (std::uint32_t k = 0; k <= strip_.count; ++k) {
      map_.face_halves(path_[k], halves_);
      gather_corners(map_, halves_, {}, corners_);
      set_firm(halves_);
      old_shape += splitter_.cost(corners_);
    }
    gather_corners(map_, ring_, {strip_.cross.data(), strip_.count}, corners_);
    set_firm(ring_);
    if (border_ != kNone) {
      divide_border();
    }
    const std::size_t n = ring_.size();
    corners_.bias.resize(n);
    bare_.resize(n);
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t v = corners_.vertex[i];
      if (v == kNone) {
        corners_.bias[i] = -kBorderDiagonal;
        continue;
      }
      bare_[i] = map_.valence(v);
      for (std::uint32_t k = 0; k < strip_.count; ++k) {
        bare_[i] -= map_.origin(strip_.cross[k]) == v || map_.target(strip_.cross[k]) == v;
      }
      corners_.bias[i] = kValenceCost / kRelaxed *
                         (irregularity(map_, v, bare_[i] + 1) - irregularity(map_, v, bare_[i]));
    }
    PolygonSplit split = splitter_.split(corners_, true, false);
    if (!split.feasible) {
      return;
    }
    double gain =
        triangles + kRelaxed * (old_shape - split.cost) - (to_border_ ? kBorderVertex : 0);
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t v = corners_.vertex[i];
      if (v == kNone) {
        // Without a diagonal the new vertex would be a flat corner.
        const bool joined =
            std::any_of(split.diagonals.begin(), split.diagonals.end(),
                        [&](const auto& d) { return d.first == i || d.second == i; });
        if (!joined) {
          return;
        }
        continue;
      }
      std::uint32_t valence = bare_[i];
      for (const auto& [a, b] : split.diagonals) {
        valence += a == i || b == i;
      }
      // Inside that is forbidden, on the boundary it would be a flat corner.
      if ((valence < 3 && valence < map_.valence(v)) ||
          (valence == bare_[i] && valence < map_.valence(v) && flat_on_crease(i))) {
        return;
      }
      gain +=
          kValenceCost * (irregularity(map_, v, map_.valence(v)) - irregularity(map_, v, valence));
    }
    if (gain > best.gain) {
      best.gain = gain;
      best.strip = strip_;
      best.ring = ring_;
      best.border = border_;
      best.split = std::move(split);
    }
  }

  /// Without a diagonal there, corner i of the ring would be a flat one along a crease.
  bool flat_on_crease(std::size_t i) const {
    const std::uint32_t h = ring_[i], before = ring_[i == 0 ? ring_.size() - 1 : i - 1];
    return before != kNone && map_.is_feature(h) && map_.is_feature(before) &&
           !map_.is_corner(map_.origin(h));
  }

  void set_firm(const std::vector<std::uint32_t>& halves) {
    corners_.firm.clear();
    if (firm_curves_) {
      for (const std::uint32_t h : halves) {
        corners_.firm.push_back(map_.on_feature(map_.origin(h)) ? 1 : 0);
      }
    }
  }

  /// Adds the middle of the boundary edge to the ring and the corners.
  void divide_border() {
    const std::size_t n = ring_.size();
    const auto at = static_cast<std::size_t>(std::find(ring_.begin(), ring_.end(), border_) -
                                             ring_.begin() + 1);
    const std::uint32_t u = map_.origin(border_), v = map_.target(border_);
    std::vector<std::uint8_t> forbidden((n + 1) * (n + 1), 0);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i + 1; j < n; ++j) {
        forbidden[(i + (i >= at)) * (n + 1) + j + (j >= at)] = corners_.forbidden[i * n + j];
      }
    }
    corners_.forbidden.swap(forbidden);
    const auto offset = static_cast<std::ptrdiff_t>(at);
    ring_.insert(ring_.begin() + offset, kNone);
    corners_.vertex.insert(corners_.vertex.begin() + offset, kNone);
    corners_.position.insert(corners_.position.begin() + offset,
                             Vec3d(0.5 * (map_.position(u) + map_.position(v))));
    const Vec3d normal = map_.normal(u) + map_.normal(v);
    const double norm = normal.norm();
    corners_.normal.insert(corners_.normal.begin() + offset,
                           norm > 0 ? Vec3d(normal / norm) : Vec3d::Zero());
    if (!corners_.firm.empty()) {
      corners_.firm.insert(corners_.firm.begin() + offset, std::uint8_t{1});
    }
  }

  const CellMap& map_;
  std::uint32_t between_;
  bool to_border_;
  bool firm_curves_;
  std::uint32_t border_ = kNone;
  Strip strip_;
  std::array<std::uint32_t, kMaxBetween + 2> path_{};
  std::vector<std::uint32_t> ring_, ids_, halves_, bare_;
  PolygonCorners corners_;
  PolygonSplitter splitter_;
};

/// Half-edges are still those of the search, as nothing in the strip has been touched; diagonals
/// may have been taken and valences lowered elsewhere.
bool still_allowed(const CellMap& map, const Candidate& c) {
  const auto in_strip = [&](std::uint32_t h) {
    for (std::uint32_t k = 0; k < c.strip.count; ++k) {
      if ((c.strip.cross[k] | 1U) == (h | 1U)) {
        return true;
      }
    }
    return false;
  };
  for (const auto& [a, b] : c.split.diagonals) {
    if (c.ring[a] == kNone || c.ring[b] == kNone) {
      continue;
    }
    const std::uint32_t h = map.find_half(map.origin(c.ring[a]), map.origin(c.ring[b]));
    if (h != CellMap::kNone && !in_strip(h)) {
      return false;
    }
  }
  for (std::uint32_t i = 0; i < c.ring.size(); ++i) {
    if (c.ring[i] == kNone) {
      continue;
    }
    const std::uint32_t v = map.origin(c.ring[i]);
    std::uint32_t valence = map.valence(v);
    for (std::uint32_t k = 0; k < c.strip.count; ++k) {
      valence -= map.origin(c.strip.cross[k]) == v || map.target(c.strip.cross[k]) == v;
    }
    for (const auto& [a, b] : c.split.diagonals) {
      valence += a == i || b == i;
    }
    if (valence < 3 && valence < map.valence(v)) {
      return false;
    }
  }
  return true;
}

/// One round of search and execution from the given triangles; returns the number of strips
/// re-split.
std::uint64_t resplit(CellMap& map, std::span<const std::uint32_t> starts, std::uint32_t between,
                      bool to_border, bool firm_curves) {
  std::vector<Candidate> found(starts.size());
  parallel_chunks(
      starts.size(),
      [&](std::size_t begin, std::size_t end) {
        Finder finder(map, between, to_border, firm_curves);
        for (std::size_t i = begin; i < end; ++i) {
          finder.search(starts[i], found[i]);
        }
      },
      kGrain);
  std::vector<std::uint32_t> order;
  for (std::uint32_t i = 0; i < found.size(); ++i) {
    if (found[i].strip.count > 0) {
      order.push_back(i);
    }
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return found[a].gain > found[b].gain; });
  std::vector<std::uint8_t> touched(map.face_count(), 0);
  std::uint64_t done = 0;
  for (const std::uint32_t i : order) {
    Candidate& c = found[i];
    const std::span<const std::uint32_t> cross(c.strip.cross.data(), c.strip.count);
    const bool free = std::all_of(cross.begin(), cross.end(), [&](std::uint32_t h) {
      return map.half_alive(h) && !touched[map.face(h)] && !touched[map.face(CellMap::twin(h))];
    });
    if (!free || !still_allowed(map, c)) {
      continue;
    }
    for (const std::uint32_t h : cross) {
      touched[map.face(h)] = touched[map.face(CellMap::twin(h))] = 1;
    }
    for (const std::uint32_t h : cross) {
      map.erase_edge(h);
    }
    if (c.border != kNone) {
      const Vec3d middle =
          0.5 * (map.position(map.origin(c.border)) + map.position(map.target(c.border)));
      *std::find(c.ring.begin(), c.ring.end(), kNone) = map.split_edge(c.border, middle);
    }
    apply_split(map, c.ring, c.split);
    touched.resize(map.face_count(), 1);  // what split_face made
    ++done;
  }
  return done;
}

}  // namespace

PairReport pair_triangles(CellMap& map, std::uint32_t max_between, bool firm_curves) {
  PairReport report;
  std::vector<std::uint32_t> triangles;
  const auto run = [&](std::uint32_t between, bool to_border, std::uint64_t& total) {
    for (int round = 0; round < 4; ++round) {
      triangles.clear();
      for (std::uint32_t f = 0; f < map.face_count(); ++f) {
        if (map.is_cell(f) && map.degree(f) == 3) {
          triangles.push_back(f);
        }
      }
      const std::uint64_t done = resplit(map, triangles, between, to_border, firm_curves);
      total += done;
      if (done == 0) {
        break;
      }
    }
  };
  const std::uint32_t most = std::min(max_between, kMaxBetween);
  for (std::uint32_t between = 0; between <= most; ++between) {
    run(between, false, report.pairs);
  }
  // A triangle at the boundary itself would become a quad with a flat corner.
  for (std::uint32_t between = 1; between <= most; ++between) {
    run(between, true, report.at_border);
  }
  return report;
}

}  // namespace rattan
