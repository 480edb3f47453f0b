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

struct Strip {
  std::uint32_t first = 0;                             ///< the triangle it starts from
  std::uint32_t count = 0;                             ///< edges crossed
  std::array<std::uint32_t, kMaxBetween + 1> cross{};  ///< half-edges, in the face that is left
};

struct Candidate {
  double gain = 0;
  Strip strip;
  std::vector<std::uint32_t> ring;  ///< half-edges around the union
  PolygonSplit split;
};

/// Finds strips and values them; one a thread.
class Finder {
 public:
  Finder(const CellMap& map, std::uint32_t between) : map_(map), between_(between) {}

  /// The best strip from the triangle to one of higher id with `between` quads in the middle; its
  /// count stays zero if none gains.
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
      if (h != entry && !map_.is_hole(g) &&
          std::find(path_.begin(), path_.begin() + strip_.count + 1, g) ==
              path_.begin() + strip_.count + 1) {
        strip_.cross[strip_.count] = h;
        if (strip_.count == between_) {
          if (map_.degree(g) == 3 && g > strip_.first) {
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
    double old_shape = -2 * PolygonSplitter::kTriangle;
    for (std::uint32_t k = 0; k <= strip_.count; ++k) {
      map_.face_halves(path_[k], halves_);
      gather_corners(map_, halves_, {}, corners_);
      old_shape += splitter_.cost(corners_);
    }
    gather_corners(map_, ring_, {strip_.cross.data(), strip_.count}, corners_);
    const std::size_t n = ring_.size();
    corners_.bias.resize(n);
    bare_.resize(n);
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t v = corners_.vertex[i];
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
    double gain = 2 * PolygonSplitter::kTriangle + kRelaxed * (old_shape - split.cost);
    for (std::uint32_t i = 0; i < ring_.size(); ++i) {
      const std::uint32_t v = map_.origin(ring_[i]);
      std::uint32_t valence = bare_[i];
      for (const auto& [a, b] : split.diagonals) {
        valence += a == i || b == i;
      }
      if (valence < 3 && !map_.on_boundary(v) && valence < map_.valence(v)) {
        return;
      }
      gain +=
          kValenceCost * (irregularity(map_, v, map_.valence(v)) - irregularity(map_, v, valence));
    }
    if (gain > best.gain) {
      best.gain = gain;
      best.strip = strip_;
      best.ring = ring_;
      best.split = std::move(split);
    }
  }

  const CellMap& map_;
  std::uint32_t between_;
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
    const std::uint32_t h = map.find_half(map.origin(c.ring[a]), map.origin(c.ring[b]));
    if (h != CellMap::kNone && !in_strip(h)) {
      return false;
    }
  }
  for (std::uint32_t i = 0; i < c.ring.size(); ++i) {
    const std::uint32_t v = map.origin(c.ring[i]);
    std::uint32_t valence = map.valence(v);
    for (std::uint32_t k = 0; k < c.strip.count; ++k) {
      valence -= map.origin(c.strip.cross[k]) == v || map.target(c.strip.cross[k]) == v;
    }
    for (const auto& [a, b] : c.split.diagonals) {
      valence += a == i || b == i;
    }
    if (valence < 3 && !map.on_boundary(v) && valence < map.valence(v)) {
      return false;
    }
  }
  return true;
}

/// One round of search and execution from the given triangles; returns the number of strips
/// re-split.
std::uint64_t resplit(CellMap& map, std::span<const std::uint32_t> starts, std::uint32_t between) {
  std::vector<Candidate> found(starts.size());
  parallel_chunks(
      starts.size(),
      [&](std::size_t begin, std::size_t end) {
        Finder finder(map, between);
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
    const Candidate& c = found[i];
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
    apply_split(map, c.ring, c.split);
    touched.resize(map.face_count(), 1);  // what split_face made
    ++done;
  }
  return done;
}

}  // namespace

PairReport pair_triangles(CellMap& map, std::uint32_t max_between) {
  PairReport report;
  std::vector<std::uint32_t> triangles;
  for (std::uint32_t between = 0; between <= std::min(max_between, kMaxBetween); ++between) {
    for (int round = 0; round < 4; ++round) {
      triangles.clear();
      for (std::uint32_t f = 0; f < map.face_count(); ++f) {
        if (map.is_cell(f) && map.degree(f) == 3) {
          triangles.push_back(f);
        }
      }
      const std::uint64_t done = resplit(map, triangles, between);
      report.pairs += done;
      if (done == 0) {
        break;
      }
    }
  }
  return report;
}

}  // namespace rattan
