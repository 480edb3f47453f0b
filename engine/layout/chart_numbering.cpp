// SPDX-License-Identifier: MIT
#include "engine/layout/chart_numbering.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "engine/core/errors.h"

namespace rattan::layout {

namespace {

/// Longer strands stand for several sides, in chart sides.
constexpr double kLongStrand = 2.5;
constexpr std::uint32_t kFewestOnLoop = 3;

class Numbering {
 public:
  Numbering(Skeleton& skeleton, std::span<const TileGraph> tiles, std::uint64_t first_point,
            double side)
      : k_(skeleton), tiles_(tiles), first_point_(first_point), side_(side) {}

  ChartNumbering run() {
    out_.face_base = k_.face_base;
    out_.arc_base = k_.arc_base;
    number_faces();
    number_points();
    list_nodes();
    list_strands();
    list_rings();
    divide();
    list_rim();
    return std::move(out_);
  }

 private:
  void number_faces() {
    ChartNumbering& o = out_;
    o.chart_of_face.assign(k_.euler.size(), kNone);
    o.chart_begin.assign(1, 0);
    std::uint32_t charts = 0;
    for (std::size_t t = 0; t < tiles_.size(); ++t) {
      for (std::uint32_t f = k_.face_base[t]; f < k_.face_base[t + 1]; ++f) {
        std::uint32_t& root = o.chart_of_face[k_.faces.find(f)];
        if (root == kNone) {
          root = charts++;
          o.graph.chart_singular.push_back(0);
        }
        o.chart_of_face[f] = root;
      }
      o.chart_begin.push_back(charts);
    }
  }

  void number_points() {
    struct Rim {
      std::uint64_t lo, hi;
      std::uint32_t tile, points;
    };
    std::vector<Rim> rims;
    for (std::uint32_t t = 0; t < tiles_.size(); ++t) {
      for (const BorderEdge& b : tiles_[t].border_edges) {
        if (b.points > 0) {
          rims.push_back({b.lo, b.hi, t, b.points});
        }
      }
    }
    const auto key = [](const Rim& r) { return std::tie(r.lo, r.hi); };
    std::sort(rims.begin(), rims.end(), [&](const Rim& x, const Rim& y) {
      return std::tie(x.lo, x.hi, x.tile) < std::tie(y.lo, y.hi, y.tile);
    });
    rims.erase(std::unique(rims.begin(), rims.end(),
                           [&](const Rim& x, const Rim& y) { return key(x) == key(y); }),
               rims.end());
    // Of each tile its rim points behind its own ones.
    std::vector<std::uint64_t> count(tiles_.size());
    for (std::size_t t = 0; t < tiles_.size(); ++t) {
      count[t] = tiles_[t].own_points;
    }
    out_.rim_points.reserve(rims.size());
    for (const Rim& r : rims) {
      out_.rim_points.push_back({r.lo, r.hi, count[r.tile]});
      count[r.tile] += r.points;
    }
    out_.point_begin.assign(1, first_point_);
    for (const std::uint64_t n : count) {
      out_.point_begin.push_back(out_.point_begin.back() + n);
    }
    for (std::size_t i = 0; i < rims.size(); ++i) {
      out_.rim_points[i].first += out_.point_begin[rims[i].tile];
    }
    out_.graph.first_division = out_.point_begin.back();
  }

  void list_nodes() {
    ChartGraph& g = out_.graph;
    node_rank_.assign(k_.nodes.size(), kNoNode);
    for (const std::uint32_t n : k_.essential) {
      if (k_.degree(n) == 0) {
        continue;
      }
      node_rank_[n] = static_cast<std::uint32_t>(out_.node_key.size());
      const PointKey& key = k_.nodes[n].key;
      out_.node_key.push_back(key);
      g.node_position.push_back(k_.nodes[n].position);
      g.node_vertex.push_back(key.is_vertex() ? key.a : ~std::uint64_t{0});
    }
  }

  std::uint32_t chart_left(std::uint32_t dart) {
    const std::uint32_t f = k_.left(dart);
    return f == kNone ? kNoChart : out_.chart_of_face[f];
  }

  void list_strands() {
    ChartGraph& g = out_.graph;
    strand_dart_.assign(2 * k_.arcs.size(), kNone);
    for (std::uint32_t s = 0; s < k_.strands.size(); ++s) {
      const Strand& strand = k_.strands[s];
      ChartStrand c;
      if (!strand.closed) {
        c.node = {node_rank_[k_.start(strand.first)], node_rank_[k_.end(strand.last)]};
        ensure(c.node[0] != kNoNode && c.node[1] != kNoNode, "strands end at nodes");
      }
      c.chart = {chart_left(strand.first), chart_left(strand.first ^ 1U)};
      ensure(c.chart[0] != kNoChart, "strands have the scan on their left");
      c.along_edges = strand.boundary || strand.cut || strand.feature;
      for (std::uint32_t d = strand.first;; d = k_.next_on_strand(d)) {
        strand_dart_[d] = 2 * s;
        strand_dart_[d ^ 1U] = 2 * s + 1;
        if (d == strand.last) {
          break;
        }
      }
      const double length = static_cast<double>(strand.length) / side_;
      const auto whole = static_cast<std::uint32_t>(std::min(std::floor(length + 0.5), 1e6));
      if (strand.closed) {
        c.parts = std::max(kFewestOnLoop, whole);
      } else if (length > kLongStrand) {
        c.parts = std::max(2U, whole);
      } else if (c.node[0] == c.node[1]) {
        c.parts = 2;
      }
      g.strands.push_back(c);
    }
    out_.dart_of_arc.assign(k_.arc_base.back(), kNone);
    for (std::uint32_t a = 0; a < k_.arc_base.back(); ++a) {
      out_.dart_of_arc[a] = strand_dart_[2 * std::size_t{a}];
    }
  }

  void list_rings() {
    ChartGraph& g = out_.graph;
    const std::uint32_t charts = out_.chart_begin.back();
    const auto left = [&](std::uint32_t dart) { return g.strands[dart >> 1].chart[dart & 1U]; };
    std::vector<std::uint32_t> first(charts, kNone);
    std::vector<std::uint32_t> count(charts, 0);
    for (std::uint32_t d = 0; d < 2 * g.strands.size(); ++d) {
      if (left(d) != kNoChart) {
        first[left(d)] = std::min(first[left(d)], d);
        ++count[left(d)];
      }
    }
    for (std::uint32_t c = 0; c < charts; ++c) {
      ensure(first[c] != kNone, "every chart has a border");
      std::uint32_t d = first[c];
      std::uint32_t n = 0;
      do {
        g.ring_darts.push_back(d);
        ensure(++n <= count[c] && left(d) == c, "a chart has one border");
        const Strand& s = k_.strands[d >> 1];
        if (!s.closed) {
          const std::uint32_t last = (d & 1U) == 0 ? s.last : s.first ^ 1U;
          d = strand_dart_[k_.next_around(last)];
          ensure(d != kNone, "around a chart strand follows strand");
        }
      } while (d != first[c]);
      ensure(n == count[c], "a chart is a disk");
      g.ring_begin.push_back(static_cast<std::uint32_t>(g.ring_darts.size()));
    }
  }

  /// Sides enough for each chart, and whether they have to be halved.
  void divide() {
    ChartGraph& g = out_.graph;
    for (std::uint32_t c = 0; c < g.chart_count(); ++c) {
      while (g.sides(c) < kFewestOnLoop) {
        // The longest for its parts; lengths compared without division.
        std::uint32_t longest = g.ring(c).front() >> 1;
        for (const std::uint32_t d : g.ring(c)) {
          const std::uint32_t s = d >> 1;
          if (k_.strands[s].length * g.strands[longest].parts >
              k_.strands[longest].length * g.strands[s].parts) {
            longest = s;
          }
        }
        ++g.strands[longest].parts;
      }
    }
    g.units = all_quads_and_simple() ? 1 : 2;
    g.division_begin.assign(1, 0);
    for (const ChartStrand& s : g.strands) {
      const std::uint64_t n = std::uint64_t{s.parts} * g.units - (s.closed() ? 0 : 1);
      g.division_begin.push_back(g.division_begin.back() + n);
    }
  }

  bool all_quads_and_simple() const {
    const ChartGraph& g = out_.graph;
    for (std::uint32_t c = 0; c < g.chart_count(); ++c) {
      if (g.sides(c) != 4) {
        return false;
      }
    }
    std::vector<std::array<std::uint32_t, 2>> ends;
    for (const ChartStrand& s : g.strands) {
      if (s.chart[0] == s.chart[1]) {
        return false;
      }
      if (s.parts == 1) {
        ends.push_back({std::min(s.node[0], s.node[1]), std::max(s.node[0], s.node[1])});
      }
    }
    std::sort(ends.begin(), ends.end());
    return std::adjacent_find(ends.begin(), ends.end()) == ends.end();
  }

  void list_rim() {
    for (auto a = static_cast<std::uint32_t>(k_.arc_base.back()); a < k_.arcs.size(); ++a) {
      const std::uint32_t dart = strand_dart_[2 * std::size_t{a}];
      if (dart == kNone) {
        continue;
      }
      const PointKey& piece = k_.arcs[a].piece;
      const PointKey low =
          piece.c == 0 ? PointKey::vertex(piece.a) : PointKey{piece.a, piece.b, piece.c - 1};
      const bool forward = k_.nodes[k_.arcs[a].node[0]].key == low;
      out_.rim_pieces.push_back({piece, forward ? dart : dart ^ 1U});
    }
    std::sort(out_.rim_pieces.begin(), out_.rim_pieces.end(),
              [](const RimPiece& x, const RimPiece& y) { return x.piece < y.piece; });
  }

  Skeleton& k_;
  std::span<const TileGraph> tiles_;
  std::uint64_t first_point_;
  double side_;
  ChartNumbering out_;
  std::vector<std::uint32_t> node_rank_;    // one a node of the skeleton
  std::vector<std::uint32_t> strand_dart_;  // one a dart of the skeleton
};

}  // namespace

std::uint32_t ChartNumbering::home(std::uint32_t chart) const {
  const auto at = std::upper_bound(chart_begin.begin(), chart_begin.end(), chart);
  return static_cast<std::uint32_t>(at - chart_begin.begin()) - 1;
}

std::uint64_t ChartNumbering::rim_first(std::uint64_t lo, std::uint64_t hi) const {
  const auto at = std::lower_bound(
      rim_points.begin(), rim_points.end(), std::tie(lo, hi),
      [](const RimPoints& r, const auto& key) { return std::tie(r.lo, r.hi) < key; });
  ensure(at != rim_points.end() && at->lo == lo && at->hi == hi, "points on rims are numbered");
  return at->first;
}

ChartNumbering number_charts(Skeleton& skeleton, std::span<const TileGraph> tiles,
                             std::uint64_t first_point, double side) {
  return Numbering(skeleton, tiles, first_point, side).run();
}

}  // namespace rattan::layout
