// SPDX-License-Identifier: MIT
#include "engine/layout/chart_pieces.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/core/errors.h"
#include "engine/core/exact_math.h"
#include "engine/layout/tile_strands.h"
#include "engine/layout/triangulate_cell.h"

namespace rattan::layout {

namespace {

constexpr std::uint8_t kInnerSide = 3;

class Cutter {
 public:
  Cutter(const OpenTile& tile, TileId id, const ChartNumbering& numbering,
         std::span<const Rgba> colours)
      : a_(tile.arrangement),
        c_(tile.coordinates),
        mesh_(tile.mesh),
        traced_(tile.traced),
        id_(id.value),
        n_(numbering),
        strands_(tile_strands(tile, id, numbering)),
        colours_(colours) {}

  TilePieces run() {
    index_.assign(c_.ids.size() + a_.point_t.size() + a_.crossings.size(), kNone);
    foreign_index_ = index_;
    list_points();
    std::uint32_t segment = 0;
    for (std::uint32_t t = 0; t < mesh_.counts.owned; ++t) {
      const std::uint32_t first = segment;
      while (segment < a_.first_edge_segment && a_.segments[segment].triangle == t) {
        ++segment;
      }
      cut_triangle(t, first, segment);
    }
    for (ChartPieces* p : {&out_.own, &out_.foreign}) {
      std::stable_sort(
          p->triangles.begin(), p->triangles.end(),
          [](const PieceTriangle& x, const PieceTriangle& y) { return x.chart < y.chart; });
    }
    std::sort(out_.singular_charts.begin(), out_.singular_charts.end());
    out_.singular_charts.erase(
        std::unique(out_.singular_charts.begin(), out_.singular_charts.end()),
        out_.singular_charts.end());
    return std::move(out_);
  }

 private:
  /// Vertices, edge points and crossings of the tile, counted through.
  std::uint32_t entity(std::uint32_t point) const {
    const auto vertices = static_cast<std::uint32_t>(c_.ids.size());
    if ((point & kCrossingTag) != 0) {
      return vertices + static_cast<std::uint32_t>(a_.point_t.size()) + (point & ~kTagMask);
    }
    return (point & kVertexTag) != 0 ? a_.vertices[point & ~kTagMask].vertex : vertices + point;
  }

  /// Points that get their numbers here, with their places in file order.
  void list_points() {
    const std::uint64_t base = n_.point_begin[id_];
    out_.points.resize(n_.point_begin[id_ + 1] - base);
    for (std::uint32_t x = 0; x < a_.crossings.size(); ++x) {
      out_.points[x].number = base + x;  // placed with its triangle
      find_node(kCrossingTag | x, base + x);
    }
    for (std::uint32_t p = 0; p < a_.point_t.size(); ++p) {
      const std::uint64_t number = strands_.point_number[p];
      if (number < base || number >= n_.point_begin[id_ + 1]) {
        continue;
      }
      out_.points[number - base] = edge_point(p);
      int degree = 0;
      for (const std::uint32_t d : a_.point_darts[p]) {
        degree += d != kNone ? 1 : 0;
      }
      const EdgePlace place = a_.place[a_.point_edge[p]];
      if (degree != 2 || place != EdgePlace::kInside) {
        find_node(p, number);
      }
    }
  }

  void find_node(std::uint32_t point, std::uint64_t number) {
    const PointKey key = a_.key(point);
    const auto at = std::lower_bound(n_.node_key.begin(), n_.node_key.end(), key);
    if (at != n_.node_key.end() && *at == key) {
      out_.nodes.push_back({static_cast<std::uint32_t>(at - n_.node_key.begin()), number});
    }
  }

  PieceVertex edge_point(std::uint32_t p) const {
    PieceVertex v;
    v.number = strands_.point_number[p];
    v.position = a_.position(p).cast<float>();
    if (!colours_.empty()) {
      const TileEdge& e = c_.edges[a_.point_edge[p]];
      const double t = a_.point_t[p];
      v.colour = mix(e.lo, e.hi, e.hi, t, 0.0);
    }
    return v;
  }

  /// Colour at barycentric coordinates u, v with respect to the second and third vertex.
  Rgba mix(std::uint32_t a, std::uint32_t b, std::uint32_t c, double u, double v) const {
    Rgba out;
    for (std::size_t i = 0; i < 4; ++i) {
      const double x = (1.0 - u - v) * colours_[a][i] + u * colours_[b][i] + v * colours_[c][i];
      out[i] = static_cast<std::uint8_t>(std::clamp(std::floor(x + 0.5), 0.0, 255.0));
    }
    return out;
  }

  // ---- one triangle ----

  struct Corner {
    std::uint32_t entity = 0;
    Vec2d place;  // barycentric
    // Periods, in the triangle's gauge; of edge points of open triangles in that of the edge's
    // lower vertex.
    std::array<double, 2> coordinate{0, 0};
    std::uint32_t side = 3;  // of an edge point
  };
  struct Side {
    std::uint32_t cell, from, to;  // from and to: entities
    std::uint32_t dart;
    std::uint8_t scan_side;  // kInnerSide: a chord
  };

  void cut_triangle(std::uint32_t t, std::uint32_t first, std::uint32_t last) {
    triangle_ = t;
    const LocalTriangle& v = mesh_.triangles[t];
    flags_ = a_.open[t] != 0 ? kOpenPiece : 0;
    corners_.clear();
    if (flags_ == 0) {
      find_gauges(t);
    } else {
      lift_ = {};
      whole_ = {};
      turn_ = {kNoTurn, kNoTurn, kNoTurn};
    }
    const std::array<Vec2d, 3> places{Vec2d(0, 0), Vec2d(1, 0), Vec2d(0, 1)};
    for (std::size_t k = 0; k < 3; ++k) {
      corners_.push_back({v[k], places[k], whole_[k]});
    }
    if (flags_ == 0) {
      const double area = (whole_[1][0] - whole_[0][0]) * (whole_[2][1] - whole_[0][1]) -
                          (whole_[1][1] - whole_[0][1]) * (whole_[2][0] - whole_[0][0]);
      flags_ = area > 0.0 ? 0 : kFoldedPiece;
    }
    cell_flags_ = flags_;
    cell_turn_ = turn_;
    set_plane(v);
    sides_.clear();
    for (std::uint32_t k = 0; k < 3; ++k) {
      walk_side(t, k, v);
    }
    if (last > first) {
      place_crossings(first, last);
    }
    for (std::uint32_t s = first; s < last; ++s) {
      const Segment& g = a_.segments[s];
      const std::uint32_t dart = strands_.segment_dart[s];
      sides_.push_back({g.left, entity(g.from), entity(g.to), dart, kInnerSide});
      sides_.push_back(
          {g.right, entity(g.to), entity(g.from), dart == kNone ? kNone : dart ^ 1U, kInnerSide});
    }
    std::stable_sort(sides_.begin(), sides_.end(),
                     [](const Side& x, const Side& y) { return x.cell < y.cell; });
    for (std::size_t i = 0; i < sides_.size();) {
      std::size_t j = i;
      while (j < sides_.size() && sides_[j].cell == sides_[i].cell) {
        ++j;
      }
      emit_cell(i, j);
      i = j;
    }
    out_.triangle_chart.push_back(largest_chart());
  }

  /// The chart with the largest share of the triangle's area, the lowest of equals.
  std::uint32_t largest_chart() {
    std::sort(shares_.begin(), shares_.end());
    std::uint32_t best = shares_.front().first;
    double most = -1.0;
    for (std::size_t i = 0; i < shares_.size();) {
      const std::uint32_t chart = shares_[i].first;
      double sum = 0.0;
      for (; i < shares_.size() && shares_[i].first == chart; ++i) {
        sum += shares_[i].second;
      }
      if (sum > most) {
        most = sum;
        best = chart;
      }
    }
    shares_.clear();
    return best;
  }

  /// Coordinates of the corners in the gauge of the first, and what carries the gauge of each
  /// side's lower vertex there.
  void find_gauges(std::uint32_t t) {
    const EdgeTransport one = c_.side_transport(3 * t);
    const EdgeTransport two = compose(one, c_.side_transport(3 * t + 1));
    const std::array<EdgeTransport, 3> corner{EdgeTransport{}, one, two};
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t v = mesh_.triangles[t][k];
      whole_[k] = carry(corner[k], level(v));
      const std::uint32_t side = 3 * t + k;
      const bool forward = c_.edges[c_.side_edge[side]].left == side;
      lift_[k] = forward ? corner[k] : corner[(k + 1) % 3];
      turn_[k] = static_cast<std::uint8_t>(lift_[k].r);
    }
  }

  /// Coordinates of a vertex in its own gauge, pinned ones on their line.
  std::array<double, 2> level(std::uint32_t v) const {
    constexpr double kNearLine = 0.3;  // as the arrangement has it
    std::array<double, 2> x{c_.angles[v].theta / (2.0 * exact::kPi),
                            c_.angles[v].phi / (2.0 * exact::kPi)};
    for (std::size_t f = 0; f < 2; ++f) {
      const double line = std::floor(x[f] + 0.5);
      const bool pinned = (c_.pins[v] & (f == 0 ? kPinTheta : kPinPhi)) != 0;
      if (pinned && std::abs(x[f] - line) < kNearLine) {
        x[f] = line;
      }
    }
    return x;
  }

  static std::array<double, 2> carry(const EdgeTransport& m, std::array<double, 2> x) {
    quarter_turns(m.r, x[0], x[1]);
    return {x[0] + m.s, x[1] + m.t};
  }

  void walk_side(std::uint32_t t, std::uint32_t k, const LocalTriangle& v) {
    const std::uint32_t side = 3 * t + k;
    const std::uint32_t e = c_.side_edge[side];
    const bool forward = c_.edges[e].left == side;
    const std::uint32_t n = a_.points_on(e);
    const auto first_corner = corners_.size();
    if (n > 0) {
      add_edge_points(e, k, forward);
    }
    const std::vector<std::uint32_t>& cells = forward ? a_.left_cell : a_.right_cell;
    std::uint32_t from = v[k];
    for (std::uint32_t j = 0; j <= n; ++j) {
      const std::uint32_t to =
          j < n ? corners_[first_corner + (forward ? j : n - 1 - j)].entity : v[(k + 1) % 3];
      const std::uint32_t piece = a_.piece(e, forward ? j : n - j);
      const std::uint32_t dart = strands_.piece_dart[piece];
      sides_.push_back({cells[piece], from, to, dart == kNone || forward ? dart : dart ^ 1U,
                        static_cast<std::uint8_t>(k)});
      from = to;
    }
  }

  /// From the lower vertex to the higher: the lines' integers follow one another.
  void add_edge_points(std::uint32_t e, std::uint32_t k, bool forward) {
    const TileEdge& edge = c_.edges[e];
    const std::array<double, 2> lo = level(edge.lo);
    const std::array<double, 2> hi = carry(edge.transport, level(edge.hi));
    std::array<double, 2> up{std::floor(lo[0]) + 1.0, std::floor(lo[1]) + 1.0};
    std::array<double, 2> down{first_below(edge.lo, 0, lo[0]), first_below(edge.lo, 1, lo[1])};
    for (std::uint32_t p = a_.point_begin[e]; p < a_.point_begin[e + 1]; ++p) {
      const double t = a_.point_t[p];
      const PointKind kind = a_.point_kind[p];
      const std::size_t f = kind & 1U;
      std::array<double, 2> x{lo[0] + t * (hi[0] - lo[0]), lo[1] + t * (hi[1] - lo[1])};
      x[f] = (kind & 2U) == 0 ? up[f]++ : down[f]--;
      const double u = forward ? t : 1.0 - t;
      const Vec2d place = k == 0 ? Vec2d(u, 0.0) : k == 1 ? Vec2d(1.0 - u, u) : Vec2d(0.0, 1.0 - u);
      corners_.push_back({static_cast<std::uint32_t>(c_.ids.size()) + p, place,
                          flags_ == kOpenPiece ? x : carry(lift_[k], x), k});
    }
  }

  /// The first line below: a vertex on a line counts as above it, unless it is pinned there.
  double first_below(std::uint32_t v, std::size_t f, double x) const {
    const bool pinned = (c_.pins[v] & (f == 0 ? kPinTheta : kPinPhi)) != 0;
    return pinned && x == std::floor(x) ? x - 1.0 : std::floor(x);
  }

  /// Barycentric places of the triangle's crossings. In singular triangles lines need not be
  /// straight; there each crossing lies in the middle of its neighbours (Tutte).
  void place_crossings(std::uint32_t first, std::uint32_t last) {
    struct Found {
      std::uint32_t crossing, corner;
    };
    std::vector<Found> found;
    for (std::uint32_t s = first; s < last; ++s) {
      for (const std::uint32_t point : {a_.segments[s].from, a_.segments[s].to}) {
        if ((point & kCrossingTag) != 0) {
          const std::uint32_t x = point & ~kTagMask;
          const bool known = std::any_of(found.begin(), found.end(),
                                         [&](const Found& f) { return f.crossing == x; });
          if (!known) {
            found.push_back({x, static_cast<std::uint32_t>(corners_.size())});
            corners_.push_back({entity(point), a_.crossings[x].place, {0, 0}});
          }
        }
      }
    }
    if ((flags_ & kOpenPiece) != 0 && found.size() > 1) {
      constexpr int kRounds = 100;
      for (int round = 0; round < kRounds; ++round) {
        for (const Found& f : found) {
          Vec2d sum(0, 0);
          for (const std::uint32_t d : a_.crossings[f.crossing].darts) {
            sum += corner(entity(a_.end(d))).place;
          }
          corners_[f.corner].place = 0.25 * sum;
        }
      }
    }
    const LocalTriangle& t = mesh_.triangles[triangle_];
    const Vec3d p = a_.vertex_position(t[0]);
    for (const Found& f : found) {
      Corner& c = corners_[f.corner];
      PieceVertex& v = out_.points[f.crossing];
      v.position = (p + c.place.x() * (a_.vertex_position(t[1]) - p) +
                    c.place.y() * (a_.vertex_position(t[2]) - p))
                       .cast<float>();
      if (!colours_.empty()) {
        v.colour = mix(t[0], t[1], t[2], c.place.x(), c.place.y());
      }
      if ((flags_ & kOpenPiece) == 0) {
        for (std::uint32_t way = 0; way < 2; ++way) {
          read_line(a_.crossings[f.crossing].darts[way], c);
        }
      }
    }
  }

  /// Follows a line from a crossing to the rim, whose point tells which line it is.
  void read_line(std::uint32_t dart, Corner& c) const {
    for (int back = 0; back < 2; ++back) {
      std::uint32_t d = dart;
      std::uint32_t p = a_.end(d);
      while ((p & kCrossingTag) != 0) {
        d = opposite(p & ~kTagMask, d ^ 1U);
        p = a_.end(d);
      }
      if ((p & kVertexTag) == 0) {
        const std::uint32_t e = a_.point_edge[p];
        std::size_t k = 0;
        while (c_.side_edge[3 * triangle_ + k] != e) {
          ++k;
        }
        const std::size_t f = (a_.point_kind[p] & 1U) ^ (lift_[k].r & 1U);
        c.coordinate[f] = corner(entity(p)).coordinate[f];
        return;
      }
      dart = opposite_at_start(dart);  // that end is a corner: try the other
    }
    throw InternalError("a line crosses the rim of its triangle");
  }

  std::uint32_t opposite(std::uint32_t crossing, std::uint32_t dart) const {
    const auto& darts = a_.crossings[crossing].darts;
    for (std::size_t i = 0; i < 4; ++i) {
      if (darts[i] == dart) {
        return darts[(i + 2) & 3U];
      }
    }
    throw InternalError("a crossing lists its darts");
  }
  std::uint32_t opposite_at_start(std::uint32_t dart) const {
    return opposite(a_.start(dart) & ~kTagMask, dart);
  }

  const Corner& corner(std::uint32_t entity) const {
    for (const Corner& c : corners_) {
      if (c.entity == entity) {
        return c;
      }
    }
    throw InternalError("a cell's corners belong to its triangle");
  }

  /// A plane in which cells are divided: the triangle's own, or where it has no area, any.
  void set_plane(const LocalTriangle& v) {
    const Vec3d p = a_.vertex_position(v[0]);
    const Vec3d a = a_.vertex_position(v[1]) - p;
    const Vec3d b = a_.vertex_position(v[2]) - p;
    const double aa = a.squaredNorm();
    const double ab = a.dot(b);
    const double bb = b.squaredNorm();
    const double det = aa * bb - ab * ab;
    constexpr double kThin = 1e-8;
    if (det > kThin * aa * bb && aa > 0.0) {
      const double length = std::sqrt(aa);
      axis_ = {Vec2d(length, 0.0), Vec2d(ab / length, std::sqrt(det) / length)};
    } else {
      axis_ = {Vec2d(1.0, 0.0), Vec2d(0.5, 0.8660254037844386)};
    }
  }

  void emit_cell(std::size_t first, std::size_t last) {
    // Chain the sides: a cell visits a point once.
    const std::size_t n = last - first;
    ring_.clear();
    std::size_t at = first;
    for (std::size_t i = 0; i < n; ++i) {
      ring_.push_back(sides_[at]);
      const std::uint32_t to = sides_[at].to;
      for (at = first; at < last && sides_[at].from != to; ++at) {
      }
      ensure(at < last, "a cell's sides close");
    }
    ensure(n >= 3 && at == first, "a cell is a polygon");
    if (flags_ == kOpenPiece) {
      find_cell_gauge();
    }
    polygon_.clear();
    for (const Side& s : ring_) {
      const Corner& c = corner(s.from);
      polygon_.push_back(c.place.x() * axis_[0] + c.place.y() * axis_[1]);
    }
    cut_.clear();
    triangulator_.triangulate(polygon_, cut_);

    const std::uint32_t face = traced_.face_of_cell[ring_[0].cell];
    const std::uint32_t chart = n_.chart_of_face[n_.face_base[id_] + face];
    const bool own = chart >= n_.chart_begin[id_];
    ChartPieces& pieces = own ? out_.own : out_.foreign;
    std::vector<std::uint32_t>& index = own ? index_ : foreign_index_;
    if ((cell_flags_ & kSingularPiece) != 0) {
      out_.singular_charts.push_back(chart);
    }
    double area = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      const Vec2d& p = polygon_[i];
      const Vec2d& q = polygon_[(i + 1) % n];
      area += p.x() * q.y() - p.y() * q.x();
    }
    shares_.emplace_back(chart, area);
    for (const auto& corners : cut_) {
      PieceTriangle t;
      t.chart = chart;
      t.flags = cell_flags_;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t i = corners[k];
        const std::uint32_t j = corners[(k + 1) % 3];
        const Corner& c = corner(ring_[i].from);
        t.vertex[k] = vertex(pieces, index, c.entity);
        const std::array<double, 2> x = flags_ == kOpenPiece ? cell_coordinates_[i] : c.coordinate;
        t.coordinate[k] = {static_cast<float>(x[0]), static_cast<float>(x[1])};
        if (j == (i + 1) % n) {
          t.dart[k] = ring_[i].dart;
          if (ring_[i].scan_side != kInnerSide) {
            t.turn[k] = cell_turn_[ring_[i].scan_side];
          }
        }
      }
      pieces.triangles.push_back(t);
    }
  }

  // ---- cells of open triangles ----

  /// Where a cell lies around one corner of an open triangle, it has coordinates in that corner's
  /// gauge: lines beside it are joined around that corner. What is left of the triangle, with the
  /// ends of lines that find no partner, holds the singularity.
  void find_cell_gauge() {
    cell_flags_ = kOpenPiece;
    cell_turn_ = {kNoTurn, kNoTurn, kNoTurn};
    cell_coordinates_.assign(ring_.size(), {0.0, 0.0});
    std::uint32_t sides = 0;
    for (std::size_t i = 0; i < ring_.size(); ++i) {
      const Side& s = ring_[i];
      if (s.scan_side == kInnerSide) {
        continue;
      }
      sides |= 1U << s.scan_side;
      if (s.scan_side == ring_[(i + 1) % ring_.size()].scan_side) {
        return;  // a line ends between the two pieces
      }
    }
    if (sides == 0 || sides == 7) {
      return;
    }
    std::uint32_t k = 0;
    while ((sides & (1U << k)) == 0 || (sides & (1U << ((k + 2) % 3))) != 0) {
      ++k;  // the first of its sides, counter-clockwise
    }
    // Two sides meet at the end of the first; of one alone either end would do.
    const std::uint32_t centre = (sides & (1U << ((k + 1) % 3))) != 0 ? (k + 1) % 3 : k;
    const std::uint32_t out = centre;
    const std::uint32_t in = (centre + 2) % 3;
    std::array<EdgeTransport, 3> gauge{};  // of corners, to that of the centre
    gauge[(centre + 1) % 3] = c_.side_transport(3 * triangle_ + out);
    gauge[in] = inverse(c_.side_transport(3 * triangle_ + in));
    std::array<EdgeTransport, 3> lift{};  // of sides' lower vertices
    for (const std::uint32_t side : {out, in}) {
      const bool forward =
          c_.edges[c_.side_edge[3 * triangle_ + side]].left == 3 * triangle_ + side;
      lift[side] = gauge[forward ? side : (side + 1) % 3];
    }
    for (std::size_t i = 0; i < ring_.size(); ++i) {
      if (!cell_coordinate(ring_[i].from, in, out, gauge, lift, cell_coordinates_[i])) {
        return;
      }
    }
    double area = 0.0;
    for (std::size_t i = 0; i < ring_.size(); ++i) {
      const auto& p = cell_coordinates_[i];
      const auto& q = cell_coordinates_[(i + 1) % ring_.size()];
      area += p[0] * q[1] - p[1] * q[0];
    }
    cell_flags_ = area > 0.0 ? kPartialPiece : kFoldedPiece;
    cell_turn_[out] = static_cast<std::uint8_t>(lift[out].r);
    cell_turn_[in] = static_cast<std::uint8_t>(lift[in].r);
  }

  bool cell_coordinate(std::uint32_t entity, std::uint32_t in, std::uint32_t out,
                       const std::array<EdgeTransport, 3>& gauge,
                       const std::array<EdgeTransport, 3>& lift, std::array<double, 2>& x) const {
    const Corner& c = corner(entity);
    if (entity < c_.ids.size()) {
      for (std::uint32_t k = 0; k < 3; ++k) {
        if (mesh_.triangles[triangle_][k] == entity) {
          x = carry(gauge[k], level(entity));
        }
      }
      return true;
    }
    if (c.side != 3) {
      x = carry(lift[c.side], c.coordinate);
      return c.side == in || c.side == out;
    }
    // A crossing: each of its lines has an end on one of the two sides.
    const std::uint32_t crossing =
        entity - static_cast<std::uint32_t>(c_.ids.size() + a_.point_t.size());
    std::uint32_t known = 0;
    for (const std::uint32_t first : a_.crossings[crossing].darts) {
      std::uint32_t d = first;
      while ((a_.end(d) & kCrossingTag) != 0) {
        d = opposite(a_.end(d) & ~kTagMask, d ^ 1U);
      }
      const std::uint32_t p = a_.end(d);
      if ((p & kVertexTag) != 0) {
        continue;
      }
      const Corner& end = corner(this->entity(p));
      if (end.side == in || end.side == out) {
        const std::size_t f = (a_.point_kind[p] & 1U) ^ (lift[end.side].r & 1U);
        x[f] = carry(lift[end.side], end.coordinate)[f];
        known |= 1U << f;
      }
    }
    return known == 3;
  }

  std::uint32_t vertex(ChartPieces& pieces, std::vector<std::uint32_t>& index,
                       std::uint32_t entity) const {
    if (index[entity] != kNone) {
      return index[entity];
    }
    index[entity] = static_cast<std::uint32_t>(pieces.vertices.size());
    const std::size_t vertices = c_.ids.size();
    PieceVertex v;
    if (entity < vertices) {
      v.number = c_.ids[entity];
      v.position = mesh_.positions[entity];
      v.colour = colours_.empty() ? Rgba{} : colours_[entity];
    } else if (entity < vertices + a_.point_t.size()) {
      v = edge_point(entity - static_cast<std::uint32_t>(vertices));
    } else {
      v = out_.points[entity - vertices - a_.point_t.size()];
    }
    pieces.vertices.push_back(v);
    return index[entity];
  }

  const TileArrangement& a_;
  const TileCoordinates& c_;
  const TileMesh& mesh_;
  const TracedTile& traced_;
  std::uint32_t id_;
  const ChartNumbering& n_;
  TileStrands strands_;
  std::span<const Rgba> colours_;
  TilePieces out_;
  std::vector<std::uint32_t> index_, foreign_index_;  // one an entity: its vertex among the pieces
  // Of the triangle at hand:
  std::uint32_t triangle_ = 0;
  std::uint8_t flags_ = 0;
  std::array<EdgeTransport, 3> lift_{};
  std::array<std::array<double, 2>, 3> whole_{};
  std::array<std::uint8_t, 3> turn_{};
  std::array<Vec2d, 2> axis_;
  std::vector<Corner> corners_;
  std::vector<Side> sides_, ring_;
  // Of the cell at hand:
  std::uint8_t cell_flags_ = 0;
  std::array<std::uint8_t, 3> cell_turn_{};
  std::vector<std::array<double, 2>> cell_coordinates_;  // one a corner, of open triangles
  std::vector<Vec2d> polygon_;
  std::vector<std::pair<std::uint32_t, double>> shares_;  // of charts in the triangle
  std::vector<std::array<std::uint32_t, 3>> cut_;
  CellTriangulator triangulator_;
};

}  // namespace

TilePieces cut_tile(const OpenTile& tile, TileId id, const ChartNumbering& numbering,
                    std::span<const Rgba> colours) {
  return Cutter(tile, id, numbering, colours).run();
}

}  // namespace rattan::layout
