// SPDX-License-Identifier: MIT
#include "engine/remesh/join_triangles.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <queue>
#include <utility>
#include <vector>

#include "engine/core/errors.h"
#include "engine/core/parallel.h"

namespace rattan {
namespace {

constexpr std::uint32_t kNone = CellMap::kNone;
constexpr std::size_t kGrain = 64;

// What a path costs: a quad divided in two is cheap, a turn leaves a vertex of valence three and
// one of five, the boundary serves one triangle instead of two.
constexpr std::uint32_t kStep = 2;
constexpr std::uint32_t kTurn = 16;
constexpr std::uint32_t kBorder = 4;
// A triangle entered through a crease becomes a quad with a flat corner there.
constexpr std::uint32_t kFlat = 60;

struct Path {
  std::uint32_t cost = std::numeric_limits<std::uint32_t>::max();
  /// Half-edges crossed, each in the face that is left; empty if there is no path.
  std::vector<std::uint32_t> cross;
};

/// Whether the edge between two triangles can go: no vertex may fall to valence two, inside or with
/// a flat corner on the boundary or along a crease.
bool mergeable(const CellMap& map, std::uint32_t h) {
  if (map.is_feature(h)) {
    return false;
  }
  for (const std::uint32_t out : {h, CellMap::twin(h)}) {
    const std::uint32_t v = map.origin(out);
    const bool last =
        map.is_feature(map.around(out)) && map.is_feature(map.next(CellMap::twin(out)));
    if (map.valence(v) < 4 || (last && !map.is_corner(v))) {
      return false;
    }
  }
  return map.origin(map.prev(h)) != map.origin(map.prev(CellMap::twin(h)));
}

/// Cheapest paths from one triangle; one searcher a thread.
class Searcher {
 public:
  explicit Searcher(const CellMap& map) : map_(map), cost_(map.face_count()) {
    entry_.resize(cost_.size());
    stamp_.assign(cost_.size(), 0);
  }

  Path search(std::uint32_t triangle) {
    ++now_;
    Path best;
    queue_ = {};
    reach(triangle, 0, kNone);
    while (!queue_.empty()) {
      const auto [cost, face] = queue_.top();
      queue_.pop();
      if (cost >= best.cost) {
        break;
      }
      if (cost == cost_[face]) {
        leave(triangle, face, best);
      }
    }
    return best;
  }

 private:
  using Entry = std::pair<std::uint32_t, std::uint32_t>;  // cost, face

  void reach(std::uint32_t face, std::uint32_t cost, std::uint32_t entry) {
    if (stamp_[face] == now_ && cost_[face] <= cost) {
      return;
    }
    stamp_[face] = now_;
    cost_[face] = cost;
    entry_[face] = entry;
    queue_.emplace(cost, face);
  }

  void leave(std::uint32_t triangle, std::uint32_t face, Path& best) {
    const std::uint32_t in = entry_[face];
    const std::uint32_t start = face == triangle ? map_.face_half(face) : map_.next(in);
    std::uint32_t h = start;
    do {
      const std::uint32_t g = map_.face(CellMap::twin(h));
      const bool straight = face == triangle || h == map_.next(map_.next(in));
      const bool flat = map_.is_feature(h) && (face == triangle || map_.degree(g) == 3);
      const std::uint32_t cost = cost_[face] + (straight ? 0 : kTurn) + (flat ? kFlat : 0);
      if (map_.is_hole(g)) {
        // A triangle at the boundary itself would get a flat corner there.
        if (face != triangle) {
          finish(h, cost + kBorder, best);
        }
      } else if (map_.degree(g) == 3) {
        if (g != triangle && (face != triangle || mergeable(map_, h))) {
          finish(h, cost, best);
        }
      } else if (map_.degree(g) == 4 && g != face) {
        reach(g, cost + kStep, CellMap::twin(h));
      }
      h = map_.next(h);
    } while (h != start && h != in);
  }

  void finish(std::uint32_t h, std::uint32_t cost, Path& best) const {
    if (cost >= best.cost) {
      return;
    }
    best.cost = cost;
    best.cross.assign(1, h);
    for (std::uint32_t in = entry_[map_.face(h)]; in != kNone;
         in = entry_[map_.face(CellMap::twin(in))]) {
      best.cross.push_back(CellMap::twin(in));
    }
    std::reverse(best.cross.begin(), best.cross.end());
  }

  const CellMap& map_;
  std::vector<std::uint32_t> cost_, entry_, stamp_;
  std::uint32_t now_ = 0;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue_;
};

/// The quad between `in` (twin of what was crossed before it) and `out`, both divided already: two
/// quads, or three where the chord turns. `in_half` and `out_half` leave the two new vertices.
void divide_quad(CellMap& map, std::uint32_t in_half, std::uint32_t out_half) {
  std::vector<std::uint32_t> ring;
  const std::uint32_t face = map.face(in_half);
  map.face_halves(face, ring);
  ensure(ring.size() == 6, "a chord divides two sides of a quad");
  const auto place = [&](std::uint32_t h) {
    return static_cast<std::size_t>(std::find(ring.begin(), ring.end(), h) - ring.begin());
  };
  const std::size_t i = place(in_half), o = place(out_half);
  if ((i + 3) % 6 == o) {
    map.split_face(in_half, out_half);
    return;
  }
  const std::size_t first = i % 2;
  const std::uint32_t spokes[3] = {ring[first], ring[first + 2], ring[first + 4]};
  map.star_face(face, spokes, map.face_centre(face));
}

void carry_out(CellMap& map, const std::vector<std::uint32_t>& cross, JoinReport& report) {
  const std::uint32_t last = map.face(CellMap::twin(cross.back()));
  if (cross.size() == 1) {
    map.erase_edge(cross[0]);
    ++report.merged;
    return;
  }
  ++(map.is_hole(last) ? report.at_border : report.chords);
  std::vector<std::uint32_t> out(cross.size());
  for (std::size_t k = 0; k < cross.size(); ++k) {
    const Vec3d middle =
        0.5 * (map.position(map.origin(cross[k])) + map.position(map.target(cross[k])));
    out[k] = map.split_edge(cross[k], middle);
  }
  for (std::size_t k = 1; k < cross.size(); ++k) {
    divide_quad(map, CellMap::twin(cross[k - 1]), out[k]);
  }
}

}  // namespace

JoinReport join_triangles(CellMap& map) {
  JoinReport report;
  std::vector<std::uint32_t> triangles;
  std::vector<Path> paths;
  std::vector<std::uint32_t> order;
  std::vector<std::uint8_t> touched;
  for (;;) {
    triangles.clear();
    for (std::uint32_t f = 0; f < map.face_count(); ++f) {
      if (map.is_cell(f) && map.degree(f) == 3) {
        triangles.push_back(f);
      }
    }
    paths.assign(triangles.size(), {});
    parallel_chunks(
        triangles.size(),
        [&](std::size_t begin, std::size_t end) {
          Searcher searcher(map);
          for (std::size_t i = begin; i < end; ++i) {
            paths[i] = searcher.search(triangles[i]);
          }
        },
        kGrain);
    order.clear();
    for (std::uint32_t i = 0; i < paths.size(); ++i) {
      if (!paths[i].cross.empty()) {
        order.push_back(i);
      }
    }
    if (order.empty()) {
      report.left = triangles.size();
      return report;
    }
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return paths[a].cost < paths[b].cost;
    });
    // Nothing that a path found on its way may have changed since.
    touched.assign(map.face_count(), 0);
    for (const std::uint32_t i : order) {
      const std::vector<std::uint32_t>& cross = paths[i].cross;
      const bool free = std::all_of(cross.begin(), cross.end(), [&](std::uint32_t h) {
        const std::uint32_t f = map.face(h), g = map.face(CellMap::twin(h));
        return !touched[f] && (map.is_hole(g) || !touched[g]);
      });
      if (!free || (cross.size() == 1 && !mergeable(map, cross[0]))) {
        continue;
      }
      for (const std::uint32_t h : cross) {
        touched[map.face(h)] = 1;
        touched[map.face(CellMap::twin(h))] = 1;
      }
      carry_out(map, cross, report);
      touched.resize(map.face_count(), 1);
    }
  }
}

}  // namespace rattan
