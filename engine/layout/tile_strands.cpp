// SPDX-License-Identifier: MIT
#include "engine/layout/tile_strands.h"

#include <algorithm>

#include "engine/core/errors.h"

namespace rattan::layout {

namespace {

std::vector<std::uint32_t> segment_darts(const OpenTile& tile, std::uint32_t id,
                                         const ChartNumbering& n) {
  std::vector<std::uint32_t> darts(tile.arrangement.segments.size(), kNone);
  const auto arcs = static_cast<std::uint32_t>(tile.traced.arc_start.size());
  for (std::uint32_t arc = 0; arc < arcs; ++arc) {
    const std::uint32_t along = n.dart_of_arc[n.arc_base[id] + arc];
    if (along != kNone) {
      for_each_dart_of_arc(tile.arrangement, tile.traced, arc,
                           [&](std::uint32_t dart) { darts[dart >> 1] = along ^ (dart & 1U); });
    }
  }
  return darts;
}

/// A piece of a scan edge, and whether a segment runs along it from the lower vertex.
struct Piece {
  std::uint32_t index = 0;
  bool up = true;
};

Piece piece_of(const TileArrangement& a, const Segment& s) {
  const auto vertex = [&](std::uint32_t point) { return a.vertices[point & ~kTagMask].vertex; };
  const bool from_point = (s.from & kTagMask) == 0;
  if (!from_point && (s.to & kTagMask) != 0) {  // two vertices tell the edge together
    const std::uint32_t e = a.coordinates->find_edge(vertex(s.from), vertex(s.to));
    return {a.piece(e, 0), vertex(s.from) == a.coordinates->edges[e].lo};
  }
  const std::uint32_t p = from_point ? s.from : s.to;
  const std::uint32_t other = from_point ? s.to : s.from;
  const std::uint32_t e = a.point_edge[p];
  const std::uint32_t at = p - a.point_begin[e];
  const bool towards_hi =
      (other & kTagMask) == 0 ? other > p : vertex(other) == a.coordinates->edges[e].hi;
  return {a.piece(e, towards_hi ? at + 1 : at), towards_hi == from_point};
}

std::vector<std::uint32_t> piece_darts(const TileArrangement& a, const ChartNumbering& n,
                                       const std::vector<std::uint32_t>& segment_dart) {
  const TileCoordinates& c = *a.coordinates;
  std::vector<std::uint32_t> darts(a.left_cell.size(), kNone);
  for (std::uint32_t s = a.first_edge_segment; s < a.segments.size(); ++s) {
    if (segment_dart[s] != kNone) {
      const Piece piece = piece_of(a, a.segments[s]);
      darts[piece.index] = piece.up ? segment_dart[s] : segment_dart[s] ^ 1U;
    }
  }
  for (std::uint32_t e = 0; e < a.place.size(); ++e) {
    if (a.place[e] != EdgePlace::kBorder && a.place[e] != EdgePlace::kUnknown) {
      continue;
    }
    const PointKey key = PointKey::on_edge(c.ids[c.edges[e].lo], c.ids[c.edges[e].hi], 0);
    auto at = std::lower_bound(n.rim_pieces.begin(), n.rim_pieces.end(), key,
                               [](const RimPiece& r, const PointKey& k) { return r.piece < k; });
    for (; at != n.rim_pieces.end() && at->piece.a == key.a && at->piece.b == key.b; ++at) {
      darts[a.piece(e, at->piece.c)] = at->dart;
    }
  }
  return darts;
}

/// Those that the tile alone sees follow its crossings; those on rims have theirs from the graph.
std::vector<std::uint64_t> point_numbers(const TileArrangement& a, std::uint32_t id,
                                         const ChartNumbering& n) {
  const TileCoordinates& c = *a.coordinates;
  std::vector<std::uint64_t> numbers(a.point_t.size());
  std::uint64_t next = n.point_begin[id] + a.crossings.size();
  for (std::uint32_t e = 0; e < a.place.size(); ++e) {
    const std::uint32_t points = a.points_on(e);
    if (points == 0 || a.place[e] == EdgePlace::kOutside) {
      continue;
    }
    const bool own = a.place[e] == EdgePlace::kInside || a.place[e] == EdgePlace::kBoundary;
    const std::uint64_t first =
        own ? next : n.rim_first(c.ids[c.edges[e].lo], c.ids[c.edges[e].hi]);
    next += own ? points : 0;
    for (std::uint32_t i = 0; i < points; ++i) {
      numbers[a.point_begin[e] + i] = first + i;
    }
  }
  ensure(next <= n.point_begin[id + 1], "a tile's points are counted");
  return numbers;
}

}  // namespace

TileStrands tile_strands(const OpenTile& tile, TileId id, const ChartNumbering& numbering) {
  TileStrands out;
  out.segment_dart = segment_darts(tile, id.value, numbering);
  out.piece_dart = piece_darts(tile.arrangement, numbering, out.segment_dart);
  out.point_number = point_numbers(tile.arrangement, id.value, numbering);
  return out;
}

}  // namespace rattan::layout
