// SPDX-License-Identifier: MIT
#include "engine/layout/tile_arrangement.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "engine/core/errors.h"
#include "engine/core/exact_math.h"
#include "engine/layout/arrangement.h"
#include "engine/layout/triangle_arranger.h"

namespace rattan::layout {

namespace {

/// More crossings than this on one edge means a field that is not one.
constexpr std::int64_t kMostCrossings = 1 << 20;
/// A pinned vertex further from its line than this (in lines) is where the solution gave up.
constexpr double kNearLine = 0.3;

void place_edges(TileArrangement& a) {
  const TileCoordinates& c = *a.coordinates;
  const std::uint32_t owned_sides = 3 * a.mesh->counts.owned;
  const std::uint32_t owned = a.mesh->extent.owned;
  a.place.resize(c.edges.size());
  for (std::size_t i = 0; i < c.edges.size(); ++i) {
    const TileEdge& e = c.edges[i];
    const bool left = e.left < owned_sides;
    const bool right = e.right < owned_sides;
    if (left && right) {
      a.place[i] = EdgePlace::kInside;
    } else if (!left && !right) {
      a.place[i] = EdgePlace::kOutside;
    } else if (e.left != kNoSide && e.right != kNoSide) {
      a.place[i] = EdgePlace::kBorder;
    } else {
      const bool seen = e.lo < owned || e.hi < owned;
      a.place[i] = seen ? EdgePlace::kBoundary : EdgePlace::kUnknown;
    }
  }
}

/// Lines crossed by one family along an edge: values a0 -> a1 in line units, symbolically in the
/// intervals whose odd middles are g0, g1 (in half lines). Even ones are on a line themselves:
/// pinned vertices, whose line ends there.
struct FamilyCrossings {
  double a0, a1;
  std::int64_t g0, g1;
  std::int64_t count() const {
    const std::int64_t low = std::min(g0, g1);
    const std::int64_t high = std::max(g0, g1);
    return std::max<std::int64_t>(((high + 1) >> 1) - (low >> 1) - 1, 0);
  }
  double at(std::int64_t i) const {
    const std::int64_t line = g1 > g0 ? (g0 >> 1) + 1 + i : ((g0 + 1) >> 1) - 1 - i;
    const double d = a1 - a0;
    const double t = d == 0.0 ? 0.5 : (static_cast<double>(line) - a0) / d;
    return std::clamp(t, 0.0, 1.0);
  }
  PointKind falls() const { return g1 < g0 ? 2 : 0; }
};

/// Points of an edge, from lo to hi, moved apart.
void keep_apart(std::span<double> t, double gap) {
  const auto n = static_cast<double>(t.size());
  gap = std::min(gap, 0.5 / (n + 1.0));
  double least = gap;
  for (double& x : t) {
    x = std::max(x, least);
    least = x + gap;
  }
  double most = 1.0 - gap;
  for (std::size_t i = t.size(); i-- > 0;) {
    t[i] = std::min(t[i], most);
    most = t[i] - gap;
  }
}

void place_points(TileArrangement& a, int density, std::uint64_t most_crossings, double gap) {
  const TileCoordinates& c = *a.coordinates;
  const double lines = density / (2.0 * exact::kPi);
  struct Level {
    double x, y;
    std::int32_t gx, gy;
  };
  const auto pin = [](double& x, std::int32_t& g) {
    const double line = std::floor(x + 0.5);
    if (std::abs(x - line) < kNearLine) {
      x = line;
      g = 2 * static_cast<std::int32_t>(line);
    }
  };
  std::vector<Level> levels(c.angles.size());
  for (std::size_t v = 0; v < levels.size(); ++v) {
    const double x = c.angles[v].theta * lines;
    const double y = c.angles[v].phi * lines;
    levels[v] = {x, y, 2 * static_cast<std::int32_t>(std::floor(x)) + 1,
                 2 * static_cast<std::int32_t>(std::floor(y)) + 1};
    if ((c.pins[v] & kPinTheta) != 0) {
      pin(levels[v].x, levels[v].gx);
    }
    if ((c.pins[v] & kPinPhi) != 0) {
      pin(levels[v].y, levels[v].gy);
    }
  }
  a.point_begin.assign(c.edges.size() + 1, 0);
  for (std::uint32_t i = 0; i < c.edges.size(); ++i) {
    a.point_begin[i] = static_cast<std::uint32_t>(a.point_t.size());
    if (a.place[i] == EdgePlace::kOutside) {
      continue;
    }
    const TileEdge& e = c.edges[i];
    const Level& lo = levels[e.lo];
    Level hi = levels[e.hi];
    quarter_turns(e.transport.r, hi.x, hi.y);
    quarter_turns(e.transport.r, hi.gx, hi.gy);
    const std::int64_t s = static_cast<std::int64_t>(e.transport.s) * density;
    const std::int64_t t = static_cast<std::int64_t>(e.transport.t) * density;
    const FamilyCrossings theta{lo.x, hi.x + static_cast<double>(s), lo.gx, hi.gx + 2 * s};
    const FamilyCrossings phi{lo.y, hi.y + static_cast<double>(t), lo.gy, hi.gy + 2 * t};
    const std::int64_t n_theta = theta.count();
    const std::int64_t n_phi = phi.count();
    if (n_theta + n_phi == 0) {
      continue;
    }
    if (static_cast<std::uint64_t>(n_theta + n_phi) > most_crossings) {
      throw TooManyCrossings();
    }
    ensure(n_theta + n_phi < kMostCrossings, "an edge crosses a bounded number of iso-lines");
    // Merge, ties to theta; equal places inside a family keep their order.
    std::int64_t k_theta = 0;
    std::int64_t k_phi = 0;
    while (k_theta < n_theta || k_phi < n_phi) {
      const bool take_theta =
          k_phi == n_phi || (k_theta < n_theta && theta.at(k_theta) <= phi.at(k_phi));
      const double at = take_theta ? theta.at(k_theta++) : phi.at(k_phi++);
      const bool first = a.point_t.size() == a.point_begin[i];
      a.point_t.push_back(first ? at : std::max(at, a.point_t.back()));
      a.point_kind.push_back(take_theta ? theta.falls() : static_cast<PointKind>(1 | phi.falls()));
    }
  }
  if (gap > 0.0) {
    a.point_begin[c.edges.size()] = static_cast<std::uint32_t>(a.point_t.size());
    for (std::uint32_t i = 0; i < c.edges.size(); ++i) {
      keep_apart(
          std::span(a.point_t).subspan(a.point_begin[i], a.point_begin[i + 1] - a.point_begin[i]),
          gap);
    }
  }
  a.point_begin[c.edges.size()] = static_cast<std::uint32_t>(a.point_t.size());
  a.point_edge.resize(a.point_t.size());
  for (std::uint32_t i = 0; i < c.edges.size(); ++i) {
    std::fill(a.point_edge.begin() + a.point_begin[i], a.point_edge.begin() + a.point_begin[i + 1],
              i);
  }
  a.point_darts.assign(a.point_t.size(), {kNone, kNone, kNone, kNone});
}

std::uint32_t local_vertex(const TileMesh& mesh, std::uint64_t id) {
  if (id >= mesh.extent.first && id < mesh.extent.first + mesh.extent.owned) {
    return static_cast<std::uint32_t>(id - mesh.extent.first);
  }
  const auto halo = mesh.halo_ids.span();
  const auto at = std::lower_bound(halo.begin(), halo.end(), id);
  return at != halo.end() && *at == id
             ? mesh.extent.owned + static_cast<std::uint32_t>(at - halo.begin())
             : kNone;
}

void mark_cuts(TileArrangement& a, std::span<const PointKey> cuts) {
  for (const PointKey& cut : cuts) {
    const std::uint32_t lo = local_vertex(*a.mesh, cut.a);
    const std::uint32_t hi = local_vertex(*a.mesh, cut.b);
    if (lo == kNone || hi == kNone) {
      continue;
    }
    const std::uint32_t e = a.coordinates->find_edge(lo, hi);
    if (e != kNoSide && a.place[e] != EdgePlace::kOutside) {
      a.piece_cut[a.piece(e, cut.c)] = kCutPiece;
    }
  }
}

void mark_creases(TileArrangement& a, std::span<const std::array<std::uint32_t, 2>> creases) {
  for (const auto& [lo, hi] : creases) {
    const std::uint32_t e = a.coordinates->find_edge(lo, hi);
    if (e != kNoSide && a.place[e] != EdgePlace::kOutside) {
      a.edge_feature[e] = 1;
      for (std::uint32_t i = 0; i <= a.points_on(e); ++i) {
        a.piece_cut[a.piece(e, i)] = kFeaturePiece;
      }
    }
  }
}

/// Pieces of scan edges that belong to the graph and that this tile sees from all sides.
void add_edge_segments(TileArrangement& a) {
  const TileCoordinates& c = *a.coordinates;
  a.first_edge_segment = static_cast<std::uint32_t>(a.segments.size());
  const auto vertex = [&](std::uint32_t v) { return a.graph_vertex_of(v); };
  for (std::uint32_t e = 0; e < c.edges.size(); ++e) {
    const EdgePlace place = a.place[e];
    if (place == EdgePlace::kOutside) {
      continue;
    }
    const bool boundary = place == EdgePlace::kBoundary;
    const TileEdge& edge = c.edges[e];
    const std::uint32_t n = a.points_on(e);
    bool any = false;
    for (std::uint32_t i = 0; i <= n; ++i) {
      any = any || boundary || a.piece_cut[a.piece(e, i)] != 0;
    }
    if (place == EdgePlace::kBorder || place == EdgePlace::kUnknown) {
      if (any || place == EdgePlace::kUnknown) {
        vertex(edge.lo);
        vertex(edge.hi);
      }
      continue;
    }
    if (!any) {
      continue;
    }
    for (std::uint32_t i = 0; i <= n; ++i) {
      if (!boundary && a.piece_cut[a.piece(e, i)] == 0) {
        continue;
      }
      const std::uint32_t low = i == 0 ? kVertexTag | vertex(edge.lo) : a.point_begin[e] + i - 1;
      const std::uint32_t high = i == n ? kVertexTag | vertex(edge.hi) : a.point_begin[e] + i;
      const auto dart = static_cast<std::uint32_t>(2 * a.segments.size());
      const std::uint32_t piece = a.piece(e, i);
      // Boundary segments run with the scan on their left.
      const bool forward = !boundary || edge.left != kNoSide;
      Segment s;
      s.from = forward ? low : high;
      s.to = forward ? high : low;
      s.left = forward ? a.left_cell[piece] : a.right_cell[piece];
      s.right = boundary ? kNone : a.right_cell[piece];
      s.triangle = (forward ? edge.left : edge.right) / 3;
      if (!boundary) {
        s.triangle = std::min(s.triangle, edge.right / 3);
      }
      a.segments.push_back(s);
      a.segment_feature.push_back(a.edge_feature[e]);
      const std::uint32_t up = forward ? dart : dart + 1;  // leaves `low`
      const auto leave = [&](std::uint32_t point, std::uint32_t d, std::uint32_t slot,
                             std::uint32_t neighbor) {
        if ((point & kVertexTag) == 0) {
          a.point_darts[point][slot] = d;
          return;
        }
        const std::uint32_t g = point & ~kTagMask;
        a.vertex_darts.push_back({g, d, neighbor, 0});
        a.vertices[g].triangle = std::min(a.vertices[g].triangle, s.triangle);
        a.vertices[g].boundary = a.vertices[g].boundary || boundary;
      };
      leave(low, up, 0, edge.hi);
      leave(high, up ^ 1U, 2, edge.lo);
    }
  }
  std::sort(a.vertex_darts.begin(), a.vertex_darts.end(),
            [&](const VertexDart& x, const VertexDart& y) {
              return std::tie(x.graph_vertex, c.ids[x.neighbor], x.line) <
                     std::tie(y.graph_vertex, c.ids[y.neighbor], y.line);
            });
}

}  // namespace

std::uint32_t TileArrangement::corner_cell(std::uint32_t triangle, std::uint32_t corner) const {
  const std::uint32_t side = 3 * triangle + corner;
  const std::uint32_t e = coordinates->side_edge[side];
  return coordinates->edges[e].left == side ? left_cell[piece(e, 0)]
                                            : right_cell[piece(e, points_on(e))];
}

Vec3d TileArrangement::position(std::uint32_t point) const {
  if ((point & kCrossingTag) != 0) {
    return crossings[point & ~kTagMask].position;
  }
  if ((point & kVertexTag) != 0) {
    return vertex_position(vertices[point & ~kTagMask].vertex);
  }
  const TileEdge& e = coordinates->edges[point_edge[point]];
  const Vec3d lo = vertex_position(e.lo);
  return lo + point_t[point] * (vertex_position(e.hi) - lo);
}

PointKey TileArrangement::key(std::uint32_t point) const {
  if ((point & kCrossingTag) != 0) {
    const Crossing& x = crossings[point & ~kTagMask];
    return PointKey::inside(mesh->counts.first + x.triangle, x.index);
  }
  if ((point & kVertexTag) != 0) {
    return PointKey::vertex(coordinates->ids[vertices[point & ~kTagMask].vertex]);
  }
  const std::uint32_t e = point_edge[point];
  return PointKey::on_edge(coordinates->ids[coordinates->edges[e].lo],
                           coordinates->ids[coordinates->edges[e].hi], point - point_begin[e]);
}

TileArrangement arrange_tile(const TileMesh& mesh, const TileCoordinates& coordinates, int density,
                             std::span<const PointKey> cuts,
                             std::span<const std::array<std::uint32_t, 2>> creases,
                             std::uint64_t most_crossings, double gap) {
  TileArrangement a;
  a.mesh = &mesh;
  a.coordinates = &coordinates;
  place_edges(a);
  place_points(a, density, most_crossings, gap);
  ensure(a.point_t.size() < kVertexTag / 4, "a tile's iso-lines fit its numbers");
  const std::size_t pieces = a.point_t.size() + coordinates.edges.size();
  a.left_cell.assign(pieces, kNone);
  a.right_cell.assign(pieces, kNone);
  a.piece_cut.assign(pieces, 0);
  a.edge_feature.assign(coordinates.edges.size(), 0);
  a.graph_vertex.assign(coordinates.ids.size(), kNone);
  mark_cuts(a, cuts);
  mark_creases(a, creases);
  const std::uint32_t owned = mesh.counts.owned;
  a.cell_begin.assign(owned + 1, 0);
  a.open.assign(owned, 0);
  TriangleArranger arranger(a, most_crossings);
  for (std::uint32_t t = 0; t < owned; ++t) {
    arranger.arrange(t);
  }
  add_edge_segments(a);
  return a;
}

}  // namespace rattan::layout
