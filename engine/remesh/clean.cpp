// SPDX-License-Identifier: MIT
#include "engine/remesh/clean.h"

#include <algorithm>
#include <tuple>
#include <utility>
#include <vector>

#include "engine/core/exact_math.h"

namespace rattan {
namespace {

constexpr std::uint32_t kNone = CellMap::kNone;
/// In sides: how far from its place a feature may be drawn where a vertex of it goes.
constexpr double kOffChord = 0.01;

/// What a cell of n corners costs by its degree: odd ones leave a triangle, large ones bend lines.
double degree_cost(std::uint32_t n) {
  if (n <= 2) {
    return 0;
  }
  if (n % 2 == 1) {
    return 1.0 + 0.1 * (n > 5 ? n - 5 : 0);
  }
  return 0.12 * (n - 4);
}

class Cleaner {
 public:
  Cleaner(CellMap& map, double side) : map_(map), side_(side) {}

  /// Ends of features inside a cell get a second edge, to the corner that continues them best.
  void join_loose_ends() {
    std::vector<std::uint32_t> halves;
    for (std::uint32_t v = 0; v < map_.vertex_count(); ++v) {
      if (!map_.vertex_alive(v) || map_.valence(v) != 1 || !map_.is_corner(v)) {
        continue;
      }
      const std::uint32_t h = map_.vertex_half(v);
      const std::uint32_t u = map_.target(h);
      map_.face_halves(map_.face(h), halves);
      const Vec3d along = map_.position(v) - map_.position(u);
      std::uint32_t best = kNone;
      double least = 0.0;
      for (const std::uint32_t to : halves) {
        const std::uint32_t w = map_.origin(to);
        if (w == u || w == v || map_.valence(w) < 2) {
          continue;
        }
        const Vec3d way = map_.position(w) - map_.position(v);
        const double lengths = std::max(way.norm() * along.norm(), 1e-300);
        const double cost = way.norm() * (2.0 - way.dot(along) / lengths);
        if (best == kNone || cost < least) {
          best = to;
          least = cost;
        }
      }
      if (best != kNone) {
        map_.split_face(h, best);
      }
    }
  }

  void remove_small() {
    for (std::uint32_t f = 0; f < map_.face_count(); ++f) {
      note_face(f);
    }
    for (std::uint32_t v = 0; v < map_.vertex_count(); ++v) {
      note_vertex(v);
    }
    drain();
  }

  bool join_edges() {
    bool any = false;
    for (std::uint32_t v = 0; v < map_.vertex_count(); ++v) {
      any |= map_.vertex_alive(v) && try_join(v);
    }
    drain();
    return any;
  }

  bool contract_short(double below) {
    std::vector<std::pair<double, std::uint32_t>> order;
    const double limit = 2 * below * side_;
    for (std::uint32_t h = 0; h < map_.half_count(); h += 2) {
      if (map_.half_alive(h)) {
        const double length = map_.length(h);
        if (length < limit) {
          order.emplace_back(length, h);
        }
      }
    }
    std::sort(order.begin(), order.end());
    bool any = false;
    for (const auto& [length, h] : order) {
      if (map_.half_alive(h)) {
        any |= try_contract(h, below * side_);
      }
    }
    drain();
    return any;
  }

  void make_simple() {
    for (std::uint32_t h = 0; h < map_.half_count(); ++h) {
      if (map_.half_alive(h) && map_.next(h) == CellMap::twin(h) &&
          map_.next(CellMap::twin(h)) == h) {
        map_.split_face(h, CellMap::twin(h));  // a sphere of one edge
      }
    }
    for (std::uint32_t f = 0; f < map_.face_count(); ++f) {
      while (map_.face_alive(f) && map_.is_hole(f) && map_.degree(f) < 3) {
        split(map_.face_half(f));
      }
    }
    const std::uint32_t halves = map_.half_count();
    std::vector<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>> edges;
    for (std::uint32_t h = 0; h < halves; h += 2) {
      if (!map_.half_alive(h)) {
        continue;
      }
      const std::uint32_t u = map_.origin(h), v = map_.target(h);
      if (u == v) {
        split(split(h));
      } else {
        edges.emplace_back(std::min(u, v), std::max(u, v), h);
      }
    }
    std::sort(edges.begin(), edges.end());
    for (std::size_t i = 0; i < edges.size();) {
      std::size_t j = i + 1;
      while (j < edges.size() && std::get<0>(edges[j]) == std::get<0>(edges[i]) &&
             std::get<1>(edges[j]) == std::get<1>(edges[i])) {
        ++j;
      }
      if (j - i > 1) {
        // The edge whose division costs most stays whole.
        std::size_t keep = i;
        double most = split_cost(std::get<2>(edges[i]));
        for (std::size_t k = i + 1; k < j; ++k) {
          const double cost = split_cost(std::get<2>(edges[k]));
          if (cost > most) {
            most = cost;
            keep = k;
          }
        }
        for (std::size_t k = i; k < j; ++k) {
          if (k != keep) {
            split(std::get<2>(edges[k]));
          }
        }
      }
      i = j;
    }
  }

  CleanReport report;

 private:
  double cell_cost(std::uint32_t f, int change) const {
    return map_.is_hole(f)
               ? 0.0
               : degree_cost(static_cast<std::uint32_t>(static_cast<int>(map_.degree(f)) + change));
  }

  /// Change of the degree costs if both sides of h gain `change` corners.
  double parity_change(std::uint32_t h, int change) const {
    const std::uint32_t f = map_.face(h), g = map_.face(CellMap::twin(h));
    if (f == g) {
      return cell_cost(f, 2 * change) - cell_cost(f, 0);
    }
    return cell_cost(f, change) + cell_cost(g, change) - cell_cost(f, 0) - cell_cost(g, 0);
  }

  double split_cost(std::uint32_t h) const { return parity_change(h, 1); }

  double length_cost(double length) const {
    const double ratio = exact::log(std::max(length, 1e-3 * side_) / side_);
    return 0.5 * std::min(ratio * ratio, 4.0);
  }

  std::uint32_t split(std::uint32_t h) {
    ++report.split_edges;
    const bool loop = map_.origin(h) == map_.target(h);
    Vec3d p = 0.5 * (map_.position(map_.origin(h)) + map_.position(map_.target(h)));
    // The chord says nothing of where a loop or one of several parallel edges runs: lean to the
    // neighbouring cells.
    const std::uint32_t f = map_.face(h), g = map_.face(CellMap::twin(h));
    if (!map_.is_hole(f) && !map_.is_hole(g)) {
      p += (loop ? 0.2 : 0.4) * (0.5 * (map_.face_centre(f) + map_.face_centre(g)) - p);
    }
    return map_.split_edge(h, p);
  }

  void note_face(std::uint32_t f) {
    if (map_.is_cell(f) && map_.degree(f) <= 2) {
      faces_.push_back(f);
    }
  }
  void note_vertex(std::uint32_t v) {
    if (map_.vertex_alive(v) && map_.valence(v) == 1) {
      vertices_.push_back(v);
    }
  }
  void note_edge_gone(std::uint32_t f, std::uint32_t u, std::uint32_t v) {
    note_face(f);
    note_vertex(u);
    note_vertex(v);
  }

  void drain() {
    while (!faces_.empty() || !vertices_.empty()) {
      if (!vertices_.empty()) {
        const std::uint32_t v = vertices_.back();
        vertices_.pop_back();
        if (map_.vertex_alive(v) && map_.valence(v) == 1) {
          remove_dangling(v);
        }
      } else {
        const std::uint32_t f = faces_.back();
        faces_.pop_back();
        if (map_.is_cell(f) && map_.degree(f) <= 2) {
          remove_face(f);
        }
      }
    }
  }

  void remove_dangling(std::uint32_t v) {
    const std::uint32_t h = CellMap::twin(map_.vertex_half(v));
    const std::uint32_t u = map_.origin(h), f = map_.face(h);
    if (map_.valence(u) == 1) {
      return;  // the component is this edge
    }
    map_.contract_edge(h, Vec3d(map_.position(u)));
    ++report.erased_edges;
    note_edge_gone(f, u, u);
  }

  void remove_face(std::uint32_t f) {
    const std::uint32_t h1 = map_.face_half(f), h2 = map_.next(h1);
    std::uint32_t best = kNone, best_degree = 0;
    for (const std::uint32_t h : {h1, h2}) {
      const std::uint32_t g = map_.face(CellMap::twin(h));
      // The union keeps an edge, and isn't a sphere of one edge.
      if (g != f && !map_.is_hole(g) && map_.degree(g) + map_.degree(f) > 2 &&
          (best == kNone || std::pair(!map_.is_feature(h), map_.degree(g)) >
                                std::pair(!map_.is_feature(best), best_degree))) {
        best = h;
        best_degree = map_.degree(g);
      }
    }
    if (best == kNone) {
      return;
    }
    if (h1 != h2 && map_.is_feature(best)) {
      map_.set_feature(best == h1 ? h2 : h1, true);  // the same ends, and no other edge between
    }
    const std::uint32_t u = map_.origin(best), v = map_.target(best);
    const std::uint32_t kept = map_.erase_edge(best);
    ++report.erased_edges;
    note_edge_gone(kept, u, v);
  }

  bool try_join(std::uint32_t v) {
    if (map_.valence(v) != 2 || map_.on_boundary(v) || map_.is_corner(v)) {
      return false;
    }
    const std::uint32_t h = map_.vertex_half(v);
    const std::uint32_t u = map_.target(h), w = map_.target(map_.around(h));
    const std::uint32_t f = map_.face(h), g = map_.face(CellMap::twin(h));
    if (u == v || u == w || f == g || map_.degree(f) < 4 || map_.degree(g) < 4 ||
        map_.adjacent(u, w)) {
      return false;
    }
    if (map_.on_feature(v) && !follows_chord(v, u, w)) {
      return false;
    }
    // A vertex that stays will have one more edge at least, hence mostly be irregular.
    const double whole = (map_.position(u) - map_.position(w)).norm();
    const double keep =
        0.3 + length_cost(map_.length(h)) + length_cost(map_.length(map_.around(h)));
    if (parity_change(h, -1) + length_cost(whole) >= keep) {
      return false;
    }
    if (map_.is_feature(h)) {
      map_.set_feature(map_.around(h), true);
    }
    map_.contract_edge(CellMap::twin(h), Vec3d(map_.position(u)));
    ++report.joined_edges;
    return true;
  }

  /// A feature stays where it is if v goes from between u and w.
  bool follows_chord(std::uint32_t v, std::uint32_t u, std::uint32_t w) const {
    const Vec3d chord = map_.position(w) - map_.position(u);
    const Vec3d off = map_.position(v) - map_.position(u);
    const double length2 = chord.squaredNorm();
    const double along = length2 > 0.0 ? off.dot(chord) / length2 : 0.0;
    return along > 0.0 && along < 1.0 && (off - along * chord).norm() < kOffChord * side_;
  }

  bool try_contract(std::uint32_t h, double threshold) {
    const std::uint32_t t = CellMap::twin(h);
    const std::uint32_t u = map_.origin(h), v = map_.target(h);
    const std::uint32_t f = map_.face(h), g = map_.face(t);
    if (u == v || f == g) {
      return false;
    }
    const double factor = std::clamp(1 - 0.5 * parity_change(h, -1), 0.3, 2.0);
    if (map_.length(h) >= threshold * factor) {
      return false;
    }
    const bool border = map_.is_hole(f) || map_.is_hole(g);
    const bool along = border || map_.is_feature(h);
    if (border && map_.degree(map_.is_hole(f) ? f : g) <= 3) {
      return false;
    }
    const bool fixed_u = map_.is_corner(u), fixed_v = map_.is_corner(v);
    const bool border_u = map_.on_boundary(u), border_v = map_.on_boundary(v);
    const bool curve_u = map_.on_curve(u), curve_v = map_.on_curve(v);
    if ((fixed_u && fixed_v) || (border_u && border_v && !border) ||
        (curve_u && curve_v && !along)) {
      return false;
    }
    if ((fixed_u && border_v && !border_u) || (fixed_v && border_u && !border_v) ||
        (fixed_u && curve_v && !curve_u) || (fixed_v && curve_u && !curve_v)) {
      return false;
    }
    // Link condition: u and v share the apices of the triangles at the edge, and no other
    // neighbour.
    std::uint32_t triangles = 0;
    for (const std::uint32_t side : {h, t}) {
      if (map_.degree(map_.face(side)) == 3 && !map_.is_hole(map_.face(side))) {
        const std::uint32_t apex = map_.origin(map_.prev(side));
        if (map_.valence(apex) < (map_.on_boundary(apex) ? 3U : 4U)) {
          return false;
        }
        // The doubled edge must be free to go to a cell on one side.
        if (map_.is_hole(map_.face(CellMap::twin(map_.next(side)))) &&
            map_.is_hole(map_.face(CellMap::twin(map_.prev(side))))) {
          return false;
        }
        ++triangles;
      }
    }
    std::uint32_t merged = map_.valence(u) + map_.valence(v) - 2 - triangles;
    if (merged > 7 || merged < (border_u || border_v ? 2U : 3U)) {
      return false;
    }
    std::uint32_t shared = 0, direct = 0;
    std::uint32_t a = h;
    do {
      const std::uint32_t w = map_.target(a);
      direct += w == v;
      if (w == u) {
        return false;
      }
      if (w != v) {
        shared += map_.adjacent(w, v);
      }
      a = map_.around(a);
    } while (a != h);
    if (shared != triangles || direct != 1) {
      return false;
    }
    Vec3d p = 0.5 * (map_.position(u) + map_.position(v));
    if (fixed_u || (border_u && !border_v)) {
      p = map_.position(u);
    } else if (fixed_v || (border_v && !border_u)) {
      p = map_.position(v);
    } else if (curve_u != curve_v) {
      p = map_.position(curve_u ? u : v);
    }
    map_.contract_edge(h, p);
    ++report.contracted_edges;
    note_face(f);
    note_face(g);
    drain();
    return true;
  }

  CellMap& map_;
  double side_;
  std::vector<std::uint32_t> faces_, vertices_;
};

}  // namespace

CleanReport clean(CellMap& map, double side, double contract_below) {
  Cleaner cleaner(map, side);
  cleaner.join_loose_ends();
  cleaner.remove_small();
  if (contract_below > 0) {
    for (int round = 0; round < 3; ++round) {
      const bool joined = cleaner.join_edges();
      const bool contracted = cleaner.contract_short(contract_below);
      if (!joined && !contracted) {
        break;
      }
    }
  }
  cleaner.make_simple();
  return cleaner.report;
}

}  // namespace rattan
