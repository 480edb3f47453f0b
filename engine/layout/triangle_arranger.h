// SPDX-License-Identifier: MIT
#pragma once

// One triangle of the arrangement: how crossings on its sides are joined into chords, where the
// chords cross, and the cells they leave. Part of tile_arrangement.cpp.

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "engine/core/errors.h"
#include "engine/layout/arrangement.h"
#include "engine/layout/tile_arrangement.h"

namespace rattan::layout {

/// Arranges one triangle after the other; keeps its scratch arrays. Needs place, point_*, and room
/// in left_cell, right_cell, cell_begin and open; triangles come in ascending order.
class TriangleArranger {
 public:
  TriangleArranger(TileArrangement& a, std::uint64_t most_crossings)
      : a_(a), kinds_(a.point_kind), most_crossings_(most_crossings) {}

  void arrange(std::uint32_t triangle) {
    const TileCoordinates& c = *a_.coordinates;
    triangle_ = triangle;
    std::uint32_t ports = 0;
    for (std::uint32_t k = 0; k < 3; ++k) {
      edge_[k] = c.side_edge[3 * triangle + k];
      forward_[k] = c.edges[edge_[k]].left == 3 * triangle + k;
      offset_[k] = ports;
      ports += a_.points_on(edge_[k]);
    }
    offset_[3] = ports;
    const EdgeTransport h = c.holonomy(triangle);
    a_.open[triangle] = h == EdgeTransport{} ? 0 : 1;
    first_cell_ = a_.cell_begin[triangle];
    if (ports == 0) {
      gap_cell_.assign(1, first_cell_);
      a_.cell_begin[triangle + 1] = first_cell_ + 1;
      store_pieces();
      return;
    }
    point_.resize(ports);
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t n = offset_[k + 1] - offset_[k];
      const std::uint32_t begin = a_.point_begin[edge_[k]];
      for (std::uint32_t j = 0; j < n; ++j) {
        point_[offset_[k] + j] = forward_[k] ? begin + j : begin + n - 1 - j;
      }
    }
    partner_.assign(ports, kNone);
    lines_at_corner_ = {0, 0, 0};
    if (h.r == 0) {
      join_aligned();
      if (a_.open[triangle] == 0) {
        end_at_corners();
      }
    } else {
      join_corners();
    }
    find_crossings();
    find_cells();
    store_pieces();
  }

 private:
  struct Chord {
    std::uint32_t a, b;           // ports, a < b
    std::uint32_t first_entry;    // its crossings, in order from a to b
    std::uint32_t first_segment;  // local segment number
  };
  struct Entry {
    std::uint32_t port;      // end of the other chord between a and b
    std::uint32_t crossing;  // local number
    bool second;             // this chord is the later one of the two
  };

  struct Later {
    std::uint32_t chord;
    std::uint32_t place;  // among the chords that cross that one and began before it
  };
  static constexpr std::uint32_t kManyPorts = 48;

  void join(std::uint32_t p, std::uint32_t q) {
    partner_[p] = q;
    partner_[q] = p;
  }

  /// All three corners share a gauge up to periods: crossings of opposite cyclic sign are joined
  /// around the corners. In a closed triangle nothing remains; otherwise density * |charge| ends
  /// do.
  void join_aligned() {
    const TileCoordinates& c = *a_.coordinates;
    const std::uint32_t r1 = c.side_transport(3 * triangle_).r;
    const std::uint32_t r2 = (4 - c.side_transport(3 * triangle_ + 2).r) & 3U;
    // Gauge of each edge's lower vertex with respect to the first corner, the lowest of the three.
    const std::array<std::uint32_t, 3> r{0, forward_[1] ? r1 : r2, 0};
    for (auto& list : family_) {
      list.clear();
    }
    std::array<std::array<std::uint32_t, 4>, 2> begin{};
    std::array<std::array<int, 3>, 2> sign{};
    for (std::uint32_t k = 0; k < 3; ++k) {
      begin[0][k] = static_cast<std::uint32_t>(family_[0].size());
      begin[1][k] = static_cast<std::uint32_t>(family_[1].size());
      for (std::uint32_t q = offset_[k]; q < offset_[k + 1]; ++q) {
        const PointKind kind = turn_kind(kinds_[point_[q]], r[k]);
        const bool falls = ((kind & 2U) != 0) == forward_[k];
        family_[kind & 1U].push_back(q);
        sign[kind & 1U][k] = falls ? -1 : 1;
      }
    }
    for (int f = 0; f < 2; ++f) {
      begin[f][3] = static_cast<std::uint32_t>(family_[f].size());
      join_family(family_[f], begin[f], sign[f]);
    }
  }

  void join_family(const std::vector<std::uint32_t>& list,
                   const std::array<std::uint32_t, 4>& begin, const std::array<int, 3>& sign) {
    // The side whose sign differs from the other two meets both of them.
    int odd = -1;
    for (int k = 0; k < 3; ++k) {
      const int next = sign[(k + 1) % 3];
      const int prev = sign[(k + 2) % 3];
      if (sign[k] != 0 && sign[k] * next <= 0 && sign[k] * prev <= 0 && (next != 0 || prev != 0)) {
        odd = k;
        break;
      }
    }
    if (odd < 0) {
      return;  // one side only: its lines end in the corner opposite to it
    }
    const auto size = [&](int k) { return static_cast<int>(begin[k + 1] - begin[k]); };
    const int next = (odd + 1) % 3;
    const int prev = (odd + 2) % 3;
    int with_next = size(next);
    int with_prev = size(prev);
    const int excess = with_next + with_prev - size(odd);
    if (excess > 0) {
      const int off_prev =
          std::clamp(excess / 2, std::max(0, excess - with_next), std::min(excess, with_prev));
      with_prev -= off_prev;
      with_next -= excess - off_prev;
    }
    for (int i = 0; i < with_next; ++i) {
      join(list[begin[odd + 1] - 1 - i], list[begin[next] + i]);
    }
    for (int i = 0; i < with_prev; ++i) {
      join(list[begin[prev + 1] - 1 - i], list[begin[odd] + i]);
    }
  }

  /// Quarter turns don't close: around each corner, in its own gauge, the crossings nearer to it
  /// are joined one by one where they go the same way.
  void join_corners() {
    const TileCoordinates& c = *a_.coordinates;
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t out = k;           // side that leaves the corner
      const std::uint32_t in = (k + 2) % 3;  // side that arrives at it
      for (std::uint32_t wanted = 0; wanted < 4; ++wanted) {
        family_[0].clear();
        family_[1].clear();
        for (int which = 0; which < 2; ++which) {
          const std::uint32_t side = which == 0 ? out : in;
          const bool corner_is_lo = forward_[side] == (which == 0);
          const std::uint32_t r = corner_is_lo ? 0 : (4 - c.edges[edge_[side]].transport.r) & 3U;
          const std::uint32_t n = offset_[side + 1] - offset_[side];
          for (std::uint32_t j = 0; j < n; ++j) {
            const std::uint32_t q = which == 0 ? offset_[side] + j : offset_[side + 1] - 1 - j;
            const std::uint32_t p = point_[q];
            if ((a_.point_t[p] < 0.5) != corner_is_lo) {
              break;
            }
            PointKind kind = turn_kind(kinds_[p], r);
            if (!corner_is_lo) {
              kind ^= 2U;
            }
            if (kind == wanted) {
              family_[which].push_back(q);
            }
          }
        }
        const std::size_t n = std::min(family_[0].size(), family_[1].size());
        for (std::size_t i = 0; i < n; ++i) {
          join(family_[0][i], family_[1][i]);
        }
      }
    }
  }

  /// In a closed triangle, a line that crosses one side only runs through the corner opposite to
  /// it, a pinned vertex: it ends there. Such corners become ports in front of their sides', in the
  /// order in which their lines don't cross.
  void end_at_corners() {
    const auto ports = static_cast<std::uint32_t>(partner_.size());
    std::uint32_t loose = 0;
    for (std::uint32_t k = 0; k < 3; ++k) {
      for (std::uint32_t q = offset_[k]; q < offset_[k + 1]; ++q) {
        if (partner_[q] == kNone) {
          ++lines_at_corner_[(k + 2) % 3];
          ++loose;
        }
      }
    }
    if (loose == 0) {
      return;
    }
    // New numbers: the corner's lines, then the side's ports.
    std::array<std::uint32_t, 3> corner_begin{};
    std::array<std::uint32_t, 4> begin{};
    std::uint32_t at = 0;
    for (std::uint32_t k = 0; k < 3; ++k) {
      corner_begin[k] = at;
      at += lines_at_corner_[k];
      begin[k] = at;
      at += offset_[k + 1] - offset_[k];
    }
    begin[3] = at;
    moved_.resize(ports);
    for (std::uint32_t k = 0; k < 3; ++k) {
      for (std::uint32_t q = offset_[k]; q < offset_[k + 1]; ++q) {
        moved_[q] = begin[k] + q - offset_[k];
      }
    }
    const std::vector<std::uint32_t> old_partner = partner_;
    const std::vector<std::uint32_t> old_point = point_;
    partner_.assign(at, kNone);
    point_.assign(at, kNone);
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t c = (k + 2) % 3;
      // The first along the side takes the corner's last.
      std::uint32_t end = corner_begin[c] + lines_at_corner_[c];
      for (std::uint32_t q = offset_[k]; q < offset_[k + 1]; ++q) {
        point_[moved_[q]] = old_point[q];
        if (old_partner[q] != kNone) {
          partner_[moved_[q]] = moved_[old_partner[q]];
        } else {
          join(moved_[q], --end);
        }
      }
      const LocalTriangle& t = a_.mesh->triangles[triangle_];
      for (std::uint32_t q = corner_begin[c]; q < corner_begin[c] + lines_at_corner_[c]; ++q) {
        point_[q] = kVertexTag | a_.graph_vertex_of(t[c]);
      }
    }
    offset_ = begin;
  }

  /// Corner of a port that is one, 3 otherwise.
  std::uint32_t corner_of(std::uint32_t port) const {
    for (std::uint32_t k = 0; k < 3; ++k) {
      if (port < offset_[k] && port + lines_at_corner_[k] >= offset_[k]) {
        return k;
      }
    }
    return 3;
  }

  /// Lists the dart that leaves a port into this triangle where it starts.
  void leave(std::uint32_t port, std::uint32_t dart) {
    const std::uint32_t k = corner_of(port);
    if (k == 3) {
      a_.point_darts[point_[port]][dart_slot(port)] = dart;
      return;
    }
    const LocalTriangle& t = a_.mesh->triangles[triangle_];
    const std::uint32_t g = point_[port] & ~kTagMask;
    a_.vertex_darts.push_back({g, dart, t[(k + 1) % 3], offset_[k] - port});
    a_.vertices[g].triangle = std::min(a_.vertices[g].triangle, triangle_);
  }

  void find_crossings() {
    const auto ports = static_cast<std::uint32_t>(partner_.size());
    chords_.clear();
    entries_.clear();
    chord_at_.assign(ports, kNone);
    for (std::uint32_t q = 0; q < ports; ++q) {
      if (partner_[q] != kNone && partner_[q] > q) {
        chord_at_[q] = chord_at_[partner_[q]] = static_cast<std::uint32_t>(chords_.size());
        chords_.push_back({q, partner_[q], 0, 0});
      }
    }
    const auto first_crossing = static_cast<std::uint32_t>(a_.crossings.size());
    if (ports > kManyPorts) {
      sweep_entries(first_crossing);
    } else {
      scan_entries(first_crossing);
    }
    check_crossings(a_.crossings.size());
    std::uint32_t segments = 0;
    for (std::uint32_t i = 0; i < chords_.size(); ++i) {
      const std::size_t end = i + 1 < chords_.size() ? chords_[i + 1].first_entry : entries_.size();
      chords_[i].first_segment = segments;
      segments += static_cast<std::uint32_t>(end) - chords_[i].first_entry + 1;
    }
    chords_.push_back({0, 0, static_cast<std::uint32_t>(entries_.size()), segments});  // sentinel

    const auto base = static_cast<std::uint32_t>(a_.segments.size());
    for (std::uint32_t i = 0; i + 1 < chords_.size(); ++i) {
      const Chord& x = chords_[i];
      const std::uint32_t n = chords_[i + 1].first_entry - x.first_entry;
      std::uint32_t from = point_[x.a];
      for (std::uint32_t j = 0; j <= n; ++j) {
        const std::uint32_t s = base + x.first_segment + j;
        std::uint32_t to = point_[x.b];
        if (j < n) {
          const Entry& e = entries_[x.first_entry + j];
          Crossing& crossing = a_.crossings[first_crossing + e.crossing];
          to = kCrossingTag | (first_crossing + e.crossing);
          crossing.darts[e.second ? 1 : 0] = 2 * s + 1;
          crossing.darts[e.second ? 3 : 2] = 2 * (s + 1);
        }
        a_.segments.push_back({from, to, kNone, kNone, triangle_});
        from = to;
      }
      leave(x.a, 2 * (base + x.first_segment));
      leave(x.b, 2 * (base + x.first_segment + n) + 1);
    }
  }

  void check_crossings(std::uint64_t count) const {
    if (count > most_crossings_) {
      throw TooManyCrossings();
    }
  }

  /// Where a chord crosses a later one, which begins at port q.
  std::uint32_t add_crossing(const Chord& x, std::uint32_t q, std::uint32_t first_crossing) {
    const auto id = static_cast<std::uint32_t>(a_.crossings.size()) - first_crossing;
    Crossing crossing;
    crossing.triangle = triangle_;
    crossing.index = id;
    crossing.place = intersect(x.a, x.b, q, partner_[q]);
    crossing.position = position_at(crossing.place);
    a_.crossings.push_back(crossing);
    return id;
  }

  /// Looks at all ports between the ends of each chord: quickest for a few.
  void scan_entries(std::uint32_t first_crossing) {
    for (std::uint32_t i = 0; i < chords_.size(); ++i) {
      Chord& x = chords_[i];
      x.first_entry = static_cast<std::uint32_t>(entries_.size());
      for (std::uint32_t q = x.a + 1; q < x.b; ++q) {
        const std::uint32_t p = partner_[q];
        if (p == kNone || (p > x.a && p < x.b)) {
          continue;
        }
        if (p > x.b) {
          entries_.push_back({q, add_crossing(x, q, first_crossing), false});
        } else {
          // The other chord came first and listed this one under our first port.
          const Chord& y = chords_[chord_at_[p]];
          const Entry* first = entries_.data() + y.first_entry;
          const Entry* last = entries_.data() + chords_[chord_at_[p] + 1].first_entry;
          const Entry* e = std::lower_bound(
              first, last, x.a, [](const Entry& l, std::uint32_t port) { return l.port < port; });
          ensure(e != last && e->port == x.a, "chords of a triangle agree on their crossings");
          entries_.push_back({q, e->crossing, true});
        }
      }
    }
  }

  /// The same in time linear in ports and crossings, for needles that thousands of lines cross: the
  /// chords still open behind one that ends are those that began within it and go on.
  void sweep_entries(std::uint32_t first_crossing) {
    const auto chords = static_cast<std::uint32_t>(chords_.size());
    before_.assign(chords + 1, kNone);
    behind_.assign(chords + 1, kNone);  // the last place stands for the ends of the list
    before_[chords] = behind_[chords] = chords;
    later_.clear();
    later_begin_.assign(chords, {0, 0});
    earlier_begin_.assign(chords + 1, 0);
    for (std::uint32_t q = 0; q < partner_.size(); ++q) {
      const std::uint32_t c = chord_at_[q];
      if (c == kNone) {
        continue;
      }
      if (chords_[c].a == q) {
        before_[c] = before_[chords];
        behind_[c] = chords;
        behind_[before_[c]] = c;
        before_[chords] = c;
        continue;
      }
      later_begin_[c][0] = static_cast<std::uint32_t>(later_.size());
      for (std::uint32_t x = behind_[c]; x != chords; x = behind_[x]) {
        later_.push_back({x, earlier_begin_[x + 1]++});
      }
      later_begin_[c][1] = static_cast<std::uint32_t>(later_.size());
      behind_[before_[c]] = behind_[c];
      before_[behind_[c]] = before_[c];
      check_crossings(first_crossing + later_.size());
    }
    for (std::uint32_t c = 0; c < chords; ++c) {
      earlier_begin_[c + 1] += earlier_begin_[c];
    }
    earlier_.resize(later_.size());
    for (std::uint32_t i = 0; i < chords; ++i) {
      Chord& x = chords_[i];
      x.first_entry = static_cast<std::uint32_t>(entries_.size());
      std::uint32_t l = later_begin_[i][0];
      std::uint32_t e = earlier_begin_[i];
      while (l < later_begin_[i][1] || e < earlier_begin_[i + 1]) {
        if (e == earlier_begin_[i + 1] ||
            (l < later_begin_[i][1] && chords_[later_[l].chord].a < earlier_[e].port)) {
          const Later& other = later_[l++];
          const std::uint32_t q = chords_[other.chord].a;
          const std::uint32_t id = add_crossing(x, q, first_crossing);
          entries_.push_back({q, id, false});
          earlier_[earlier_begin_[other.chord] + other.place] = {x.b, id, true};
        } else {
          entries_.push_back(earlier_[e++]);
        }
      }
    }
  }

  /// Slot of the dart that leaves a port into this triangle.
  std::uint32_t dart_slot(std::uint32_t port) const { return forward_[side_of(port)] ? 1 : 3; }

  std::uint32_t side_of(std::uint32_t port) const {
    return port < offset_[1] ? 0 : (port < offset_[2] ? 1 : 2);
  }

  /// Walks around every cell with the cell on the left.
  void find_cells() {
    const auto ports = static_cast<std::uint32_t>(partner_.size());
    const std::uint32_t segments = chords_.back().first_segment;
    const auto base = static_cast<std::uint32_t>(a_.segments.size()) - segments;
    // Half-edges: two a segment, then the gaps; gap g runs from port g - 1 to port g.
    const std::uint32_t gaps = 2 * segments;
    next_.assign(gaps + ports, kNone);
    const auto after = [&](std::uint32_t port) {
      return gaps + (port + 1 == ports ? 0 : port + 1);
    };
    for (std::uint32_t q = 0; q < ports; ++q) {
      const std::uint32_t x = chord_at_[q];
      if (x == kNone) {
        next_[gaps + q] = after(q);
      } else {
        next_[gaps + q] = chords_[x].a == q ? 2 * chords_[x].first_segment
                                            : 2 * (chords_[x + 1].first_segment - 1) + 1;
      }
    }
    const std::size_t first_crossing = a_.crossings.size() - crossing_count();
    for (std::uint32_t i = 0; i + 1 < chords_.size(); ++i) {
      const Chord& x = chords_[i];
      const std::uint32_t n = chords_[i + 1].first_entry - x.first_entry;
      for (std::uint32_t j = 0; j <= n; ++j) {
        const std::uint32_t s = x.first_segment + j;
        const auto turn_left = [&](const Entry& e, std::uint32_t back) {
          const Crossing& crossing = a_.crossings[first_crossing + e.crossing];
          return crossing.darts[(back + 3) & 3U] - 2 * base;
        };
        next_[2 * s] = j < n ? turn_left(entries_[x.first_entry + j],
                                         entries_[x.first_entry + j].second ? 1 : 0)
                             : after(x.b);
        next_[2 * s + 1] = j > 0 ? turn_left(entries_[x.first_entry + j - 1],
                                             entries_[x.first_entry + j - 1].second ? 3 : 2)
                                 : after(x.a);
      }
    }
    std::uint32_t cells = 0;
    cell_.assign(next_.size(), kNone);
    for (std::uint32_t h = 0; h < next_.size(); ++h) {
      if (cell_[h] != kNone) {
        continue;
      }
      for (std::uint32_t at = h; cell_[at] == kNone; at = next_[at]) {
        cell_[at] = first_cell_ + cells;
      }
      ++cells;
    }
    ensure(cells == 1 + (chords_.size() - 1) + crossing_count(),
           "a triangle's cells satisfy Euler's formula");
    a_.cell_begin[triangle_ + 1] = first_cell_ + cells;
    for (std::uint32_t s = 0; s < segments; ++s) {
      a_.segments[base + s].left = cell_[2 * s];
      a_.segments[base + s].right = cell_[2 * s + 1];
    }
    gap_cell_.assign(cell_.begin() + gaps, cell_.end());
  }

  std::uint32_t crossing_count() const {
    return (chords_.back().first_entry) / 2;  // every crossing is in two lists
  }

  void store_pieces() {
    const auto ports = static_cast<std::uint32_t>(gap_cell_.size());
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t n = a_.points_on(edge_[k]);
      std::vector<std::uint32_t>& cells = forward_[k] ? a_.left_cell : a_.right_cell;
      for (std::uint32_t j = 0; j <= n; ++j) {
        std::uint32_t gap = offset_[k] + j;
        gap = gap >= ports ? gap - ports : gap;
        cells[a_.piece(edge_[k], forward_[k] ? j : n - j)] = gap_cell_[gap];
      }
    }
  }

  /// Barycentric place of a port, with respect to the second and third corner.
  Vec2d place(std::uint32_t port) const {
    const std::uint32_t corner = corner_of(port);
    if (corner < 3) {
      return {corner == 1 ? 1.0 : 0.0, corner == 2 ? 1.0 : 0.0};
    }
    const std::uint32_t k = side_of(port);
    const double t = a_.point_t[point_[port]];
    const double u = forward_[k] ? t : 1.0 - t;
    switch (k) {
      case 0:
        return {u, 0.0};
      case 1:
        return {1.0 - u, u};
      default:
        return {0.0, 1.0 - u};
    }
  }

  /// In barycentric coordinates, so that triangles without area do no harm.
  Vec2d intersect(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) const {
    const Vec2d from = place(a);
    const Vec2d along = place(b) - from;
    const Vec2d other = place(c);
    const Vec2d across = place(d) - other;
    const double det = along.x() * across.y() - along.y() * across.x();
    const Vec2d gap = other - from;
    double s = (gap.x() * across.y() - gap.y() * across.x()) / det;
    s = s >= 0.0 ? std::min(s, 1.0) : (s < 0.0 ? 0.0 : 0.5);  // NaN: the lines coincide
    return from + s * along;
  }

  Vec3d position_at(const Vec2d& w) const {
    const LocalTriangle& t = a_.mesh->triangles[triangle_];
    const Vec3d p = a_.vertex_position(t[0]);
    return p + w.x() * (a_.vertex_position(t[1]) - p) + w.y() * (a_.vertex_position(t[2]) - p);
  }

  TileArrangement& a_;
  const std::vector<PointKind>& kinds_;
  std::uint64_t most_crossings_;
  std::uint32_t triangle_ = 0;
  std::uint32_t first_cell_ = 0;
  std::array<std::uint32_t, 3> edge_{};
  std::array<bool, 3> forward_{};
  std::array<std::uint32_t, 4> offset_{};
  std::array<std::vector<std::uint32_t>, 2> family_;
  std::array<std::uint32_t, 3> lines_at_corner_{};
  std::vector<std::uint32_t> point_;
  std::vector<std::uint32_t> moved_;
  std::vector<std::uint32_t> partner_;
  std::vector<Chord> chords_;
  std::vector<Entry> entries_;
  std::vector<std::uint32_t> chord_at_;
  std::vector<std::uint32_t> before_, behind_;  // open chords, by where they began
  std::vector<Later> later_;
  std::vector<std::array<std::uint32_t, 2>> later_begin_;
  std::vector<Entry> earlier_;
  std::vector<std::uint32_t> earlier_begin_;
  std::vector<std::uint32_t> next_;
  std::vector<std::uint32_t> cell_;
  std::vector<std::uint32_t> gap_cell_;
};

}  // namespace rattan::layout
