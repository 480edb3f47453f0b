// SPDX-License-Identifier: MIT
#include "engine/layout/tile_graph.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "engine/core/errors.h"
#include "engine/layout/disjoint_sets.h"

namespace rattan::layout {

namespace {

class Tracer {
 public:
  Tracer(const TileArrangement& a, std::span<const PointKey> cuts, const TraceOptions& options)
      : a_(a), c_(*a.coordinates), mesh_(*a.mesh), cuts_(cuts), options_(options) {}

  TracedTile run() {
    find_complete_vertices();
    on_feature_.assign(c_.ids.size(), 0);
    for (std::uint32_t e = 0; e < a_.edge_feature.size(); ++e) {
      if (a_.edge_feature[e] != 0) {
        on_feature_[c_.edges[e].lo] = on_feature_[c_.edges[e].hi] = 1;
      }
    }
    label_cells();
    make_nodes();
    sum_euler();
    trace_arcs();
    list_border();
    list_fans();
    out_.graph.own_points = static_cast<std::uint32_t>(a_.crossings.size());
    for (std::uint32_t e = 0; e < a_.place.size(); ++e) {
      if (a_.place[e] == EdgePlace::kInside || a_.place[e] == EdgePlace::kBoundary) {
        out_.graph.own_points += a_.points_on(e);
      }
    }
    for (std::uint32_t i = 0; i < out_.graph.arcs.size(); ++i) {
      const GraphArc& arc = out_.graph.arcs[i];
      const double long_from = arc.right == kNone || arc.feature ? kLongBoundary : kLongInside;
      if (static_cast<double>(arc.length) > long_from * options_.side) {
        out_.graph.lines.push_back({i, arc_polyline(a_, out_, i)});
      }
    }
    return std::move(out_);
  }

 private:
  /// Owned vertices whose triangles are all owned: nothing about them is known elsewhere only.
  void find_complete_vertices() {
    complete_.assign(c_.ids.size(), 0);
    std::fill(complete_.begin(), complete_.begin() + mesh_.extent.owned, std::uint8_t{1});
    const auto triangles = mesh_.triangles.span();
    for (std::size_t t = mesh_.counts.owned; t < triangles.size(); ++t) {
      for (const std::uint32_t v : triangles[t]) {
        complete_[v] = 0;
      }
    }
  }

  void label_cells() {
    DisjointSets sets(a_.cell_count());
    for (std::uint32_t e = 0; e < a_.place.size(); ++e) {
      if (a_.place[e] == EdgePlace::kInside) {
        for (std::uint32_t p = a_.piece(e, 0); p <= a_.piece(e, a_.points_on(e)); ++p) {
          if (a_.piece_cut[p] == 0) {
            sets.unite(a_.left_cell[p], a_.right_cell[p]);
          }
        }
      }
    }
    std::uint32_t faces = 0;
    out_.face_of_cell.resize(a_.cell_count());
    for (std::uint32_t i = 0; i < a_.cell_count(); ++i) {
      const std::uint32_t root = sets.find(i);
      out_.face_of_cell[i] = root == i ? faces++ : out_.face_of_cell[root];
    }
    out_.graph.euler.assign(faces, 0);
    out_.graph.singular.assign(faces, 0);
    for (std::uint32_t t = 0; t + 1 < a_.cell_begin.size(); ++t) {
      for (std::uint32_t i = a_.cell_begin[t]; i < a_.cell_begin[t + 1]; ++i) {
        ++out_.graph.euler[face(i)];
        out_.graph.singular[face(i)] |= a_.open[t];
      }
    }
  }

  std::uint32_t face(std::uint32_t cell) const { return out_.face_of_cell[cell]; }
  std::uint32_t owned_cell(std::uint32_t piece) const {
    return a_.left_cell[piece] != kNone ? a_.left_cell[piece] : a_.right_cell[piece];
  }
  std::uint64_t global_triangle(std::uint32_t t) const { return mesh_.counts.first + t; }

  std::uint32_t degree(std::uint32_t point) const {
    std::uint32_t n = 0;
    for (const std::uint32_t d : a_.point_darts[point]) {
      n += d != kNone ? 1 : 0;
    }
    return n;
  }

  /// Both sides of every boundary vertex that is owned, from all triangles that touch it.
  void find_corners() {
    std::vector<std::uint32_t> before(mesh_.extent.owned, kNone);
    std::vector<std::uint32_t> after(mesh_.extent.owned, kNone);
    for (const TileEdge& e : c_.edges) {
      if ((e.left == kNoSide) == (e.right == kNoSide)) {
        continue;
      }
      const std::uint32_t from = e.left != kNoSide ? e.lo : e.hi;
      const std::uint32_t to = e.left != kNoSide ? e.hi : e.lo;
      if (from < mesh_.extent.owned) {
        after[from] = to;
      }
      if (to < mesh_.extent.owned) {
        before[to] = from;
      }
    }
    for (std::uint32_t v = 0; v < mesh_.extent.owned; ++v) {
      if (before[v] == kNone || after[v] == kNone) {
        continue;
      }
      const Vec3d in = a_.vertex_position(v) - a_.vertex_position(before[v]);
      const Vec3d out = a_.vertex_position(after[v]) - a_.vertex_position(v);
      const double lengths = std::sqrt(in.squaredNorm() * out.squaredNorm());
      if (lengths > 0.0 && in.dot(out) < options_.corner_cosine * lengths) {
        corners_.push_back(v);
      }
    }
  }

  std::uint32_t add_node(const GraphNode& n) {
    out_.graph.nodes.push_back(n);
    return static_cast<std::uint32_t>(out_.graph.nodes.size() - 1);
  }

  void make_nodes() {
    TileGraph& g = out_.graph;
    g.nodes.reserve(a_.crossings.size());
    for (std::uint32_t x = 0; x < a_.crossings.size(); ++x) {
      add_node({a_.key(kCrossingTag | x), a_.crossings[x].position,
                global_triangle(a_.crossings[x].triangle), kNone, 0});
    }
    out_.point_node.assign(a_.point_t.size(), kNone);
    for (std::uint32_t e = 0; e < a_.place.size(); ++e) {
      const EdgePlace place = a_.place[e];
      for (std::uint32_t p = a_.point_begin[e]; p < a_.point_begin[e + 1]; ++p) {
        const bool rim = place == EdgePlace::kBorder || place == EdgePlace::kUnknown;
        const std::uint32_t n = degree(p);
        if (!rim && (n == 0 || n == 2)) {
          continue;
        }
        GraphNode node{a_.key(p), a_.position(p), triangle_at(e), kNone, 0};
        node.face = face(owned_cell(a_.piece(e, p - a_.point_begin[e])));
        out_.point_node[p] = add_node(node);
      }
    }

    find_corners();
    // Vertices of the graph, then corners that no owned segment touches.
    out_.vertex_begin.assign(a_.vertices.size() + 1, 0);
    for (const VertexDart& d : a_.vertex_darts) {
      ++out_.vertex_begin[d.graph_vertex + 1];
    }
    for (std::size_t i = 0; i < a_.vertices.size(); ++i) {
      out_.vertex_begin[i + 1] += out_.vertex_begin[i];
    }
    out_.vertex_node.assign(a_.vertices.size(), kNone);
    for (std::uint32_t i = 0; i < a_.vertices.size(); ++i) {
      const std::uint32_t v = a_.vertices[i].vertex;
      const std::uint32_t n = out_.vertex_begin[i + 1] - out_.vertex_begin[i];
      std::uint8_t flags =
          std::binary_search(corners_.begin(), corners_.end(), v) ? kCornerNode : 0;
      if (options_.features != nullptr && options_.features->is_corner(c_.ids[v])) {
        const bool end = options_.features->is_loose_end(c_.ids[v]) && !a_.vertices[i].boundary;
        flags |= end ? kFeatureEndNode : kFeatureCornerNode;
      }
      if (complete_[v] != 0 && n == 2 && flags == 0) {
        continue;
      }
      out_.vertex_node[i] = add_node(vertex_node(v, a_.vertices[i].triangle, flags));
    }
    for (const std::uint32_t v : corners_) {
      if (a_.graph_vertex[v] == kNone) {
        add_node(vertex_node(v, kNone, kCornerNode));
      }
    }
  }

  GraphNode vertex_node(std::uint32_t v, std::uint32_t triangle, std::uint8_t flags) const {
    GraphNode n;
    n.key = PointKey::vertex(c_.ids[v]);
    n.position = a_.vertex_position(v);
    n.triangle = triangle == kNone ? ~std::uint64_t{0} : global_triangle(triangle);
    n.flags = flags;
    return n;
  }

  /// Lowest owned triangle beside an edge; other tiles' share is merged later.
  std::uint64_t triangle_at(std::uint32_t e) const {
    const std::uint32_t sides = std::min(c_.edges[e].left, c_.edges[e].right);
    const std::uint32_t other = std::max(c_.edges[e].left, c_.edges[e].right);
    return global_triangle((sides / 3 < mesh_.counts.owned ? sides : other) / 3);
  }

  void sum_euler() {
    TileGraph& g = out_.graph;
    for (std::uint32_t e = 0; e < a_.place.size(); ++e) {
      if (a_.place[e] != EdgePlace::kInside) {
        continue;
      }
      const std::uint32_t n = a_.points_on(e);
      for (std::uint32_t i = 0; i <= n; ++i) {
        const std::uint32_t piece = a_.piece(e, i);
        if (a_.piece_cut[piece] == 0) {
          --g.euler[face(a_.left_cell[piece])];
        }
        if (i < n && degree(a_.point_begin[e] + i) == 0) {
          ++g.euler[face(a_.left_cell[piece])];
        }
      }
    }
    std::vector<std::uint8_t> seen(c_.ids.size(), 0);
    const auto triangles = mesh_.triangles.span();
    for (std::uint32_t t = 0; t < mesh_.counts.owned; ++t) {
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t v = triangles[t][k];
        if (seen[v] != 0) {
          continue;
        }
        seen[v] = 1;
        if (complete_[v] == 0) {
          g.border_vertices.push_back({c_.ids[v], face(a_.corner_cell(t, k))});
        } else if (a_.graph_vertex[v] == kNone) {
          ++g.euler[face(a_.corner_cell(t, k))];
        }
      }
    }
  }

  std::uint64_t slot(std::uint32_t dart) const {
    const std::uint32_t p = a_.start(dart);
    if ((p & kVertexTag) != 0) {
      const std::uint32_t g = p & ~kTagMask;
      for (std::uint32_t i = out_.vertex_begin[g]; i < out_.vertex_begin[g + 1]; ++i) {
        if (a_.vertex_darts[i].dart == dart) {
          return vertex_slot(c_.ids[a_.vertex_darts[i].neighbor], a_.vertex_darts[i].line);
        }
      }
    } else {
      const auto& darts =
          (p & kCrossingTag) != 0 ? a_.crossings[p & ~kTagMask].darts : a_.point_darts[p];
      for (std::uint64_t i = 0; i < 4; ++i) {
        if (darts[i] == dart) {
          return i;
        }
      }
    }
    throw InternalError("a dart is listed where it starts");
  }

  std::uint32_t node_at(std::uint32_t point) const {
    if ((point & kCrossingTag) != 0) {
      return point & ~kTagMask;
    }
    return (point & kVertexTag) != 0 ? out_.vertex_node[point & ~kTagMask] : out_.point_node[point];
  }

  void trace(std::uint32_t first);
  void trace_arcs();
  void list_border();
  void list_fans();

  const TileArrangement& a_;
  const TileCoordinates& c_;
  const TileMesh& mesh_;
  std::span<const PointKey> cuts_;
  TraceOptions options_;
  TracedTile out_;
  std::vector<std::uint8_t> complete_;
  std::vector<std::uint8_t> on_feature_;  // one a local vertex: end of a sharp edge
  std::vector<std::uint32_t> corners_;    // ascending
};

void Tracer::trace(std::uint32_t first) {
  GraphArc arc;
  const auto id = static_cast<std::uint32_t>(out_.graph.arcs.size());
  const std::uint32_t left = a_.left(first);
  const std::uint32_t right = a_.left(first ^ 1U);
  ensure(left != kNone, "arcs have the scan on their left");
  arc.left = face(left);
  arc.right = right == kNone ? kNone : face(right);
  std::uint32_t last = first;
  for (std::uint32_t d = first; d != kNone;) {
    last = d;
    const std::uint32_t s = d >> 1;
    out_.arc_of_segment[s] = id;
    arc.length += fixed_length(a_.position(a_.segments[s].from), a_.position(a_.segments[s].to),
                               options_.length_scale);
    if (s >= a_.first_edge_segment && a_.segments[s].right != kNone) {
      (a_.segment_feature[s - a_.first_edge_segment] != 0 ? arc.feature : arc.cut) = true;
    }
    d = next_dart(a_, out_, d);
    if (d == first) {
      break;
    }
  }
  arc.node[0] = node_at(a_.start(first));
  if (arc.node[0] != kNone) {
    arc.node[1] = node_at(a_.end(last));
    arc.slot[0] = slot(first);
    arc.slot[1] = slot(last ^ 1U);
  }
  out_.graph.arcs.push_back(arc);
  out_.arc_start.push_back(first);
}

void Tracer::trace_arcs() {
  out_.arc_of_segment.assign(a_.segments.size(), kNone);
  // Arcs with nodes first. Boundary arcs start where their segments point forward.
  for (int pass = 0; pass < 2; ++pass) {
    for (std::uint32_t s = 0; s < a_.segments.size(); ++s) {
      if (out_.arc_of_segment[s] != kNone) {
        continue;
      }
      if (pass == 1 || node_at(a_.segments[s].from) != kNone) {
        trace(2 * s);
      } else if (a_.segments[s].right != kNone && node_at(a_.segments[s].to) != kNone) {
        trace(2 * s + 1);
      }
    }
  }
}

void Tracer::list_border() {
  TileGraph& g = out_.graph;
  for (std::uint32_t e = 0; e < a_.place.size(); ++e) {
    const EdgePlace place = a_.place[e];
    if (place != EdgePlace::kBorder && place != EdgePlace::kUnknown) {
      continue;
    }
    const TileEdge& edge = c_.edges[e];
    BorderEdge b;
    b.lo = c_.ids[edge.lo];
    b.hi = c_.ids[edge.hi];
    b.left = edge.left < 3 * mesh_.counts.owned;
    b.triangle = global_triangle((b.left ? edge.left : edge.right) / 3);
    b.first_label = static_cast<std::uint32_t>(g.border_labels.size());
    b.points = a_.points_on(e);
    b.first_node = b.points == 0 ? kNone : out_.point_node[a_.point_begin[e]];
    const auto vertex_node = [&](std::uint32_t v) {
      return a_.graph_vertex[v] == kNone ? kNone : out_.vertex_node[a_.graph_vertex[v]];
    };
    b.lo_node = vertex_node(edge.lo);
    b.hi_node = vertex_node(edge.hi);
    b.maybe_boundary = place == EdgePlace::kUnknown;
    b.feature = a_.edge_feature[e] != 0;
    for (std::uint32_t i = 0; i <= b.points; ++i) {
      g.border_labels.push_back(face(owned_cell(a_.piece(e, i))));
    }
    g.border_edges.push_back(b);
  }
}

void Tracer::list_fans() {
  std::vector<std::uint64_t> wanted;
  for (const PointKey& cut : cuts_) {
    for (const std::uint64_t v : {cut.a, cut.b}) {
      if (v >= mesh_.extent.first && v - mesh_.extent.first < mesh_.extent.owned) {
        wanted.push_back(v);
      }
    }
  }
  // Vertices of features: wherever more than two parts of the graph meet, or may do so unseen.
  for (std::uint32_t v = 0; v < mesh_.extent.owned; ++v) {
    if (c_.pins[v] == 0 && a_.graph_vertex[v] == kNone) {
      continue;
    }
    const std::uint32_t g = a_.graph_vertex[v];
    const std::uint32_t n = g == kNone ? 0 : out_.vertex_begin[g + 1] - out_.vertex_begin[g];
    if (complete_[v] == 0 ? c_.pins[v] != 0 || on_feature_[v] != 0 : n > 2) {
      wanted.push_back(c_.ids[v]);
    }
  }
  if (wanted.empty()) {
    return;
  }
  std::sort(wanted.begin(), wanted.end());
  wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
  struct Spoke {
    std::uint64_t vertex, from, to;
  };
  std::vector<Spoke> spokes;
  for (const LocalTriangle& t : mesh_.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t v = c_.ids[t[k]];
      if (std::binary_search(wanted.begin(), wanted.end(), v)) {
        spokes.push_back({v, c_.ids[t[(k + 1) % 3]], c_.ids[t[(k + 2) % 3]]});
      }
    }
  }
  std::sort(spokes.begin(), spokes.end(), [](const Spoke& x, const Spoke& y) {
    return std::tie(x.vertex, x.from) < std::tie(y.vertex, y.from);
  });
  for (std::size_t first = 0; first < spokes.size();) {
    std::size_t last = first;
    while (last < spokes.size() && spokes[last].vertex == spokes[first].vertex) {
      ++last;
    }
    // Start at the neighbour that no triangle arrives at, if the fan is open, else at the lowest.
    std::size_t at = first;
    for (std::size_t i = first; i < last; ++i) {
      const bool reached = std::any_of(spokes.begin() + static_cast<std::ptrdiff_t>(first),
                                       spokes.begin() + static_cast<std::ptrdiff_t>(last),
                                       [&](const Spoke& s) { return s.to == spokes[i].from; });
      if (!reached) {
        at = i;
      }
    }
    std::uint32_t rank = 0;
    for (std::size_t step = first; step < last; ++step) {
      out_.graph.fans.push_back({spokes[at].vertex, spokes[at].from, rank++});
      const std::uint64_t to = spokes[at].to;
      std::size_t next = first;
      while (next < last && spokes[next].from != to) {
        ++next;
      }
      if (next == last) {
        out_.graph.fans.push_back({spokes[at].vertex, to, rank++});
      } else {
        at = next;
      }
    }
    first = last;
  }
}

}  // namespace

std::uint32_t next_dart(const TileArrangement& a, const TracedTile& traced, std::uint32_t dart) {
  const std::uint32_t p = a.end(dart);
  const std::uint32_t back = dart ^ 1U;
  if ((p & kCrossingTag) != 0) {
    return kNone;
  }
  if ((p & kVertexTag) != 0) {
    const std::uint32_t g = p & ~kTagMask;
    if (traced.vertex_node[g] != kNone) {
      return kNone;
    }
    const VertexDart* d = a.vertex_darts.data() + traced.vertex_begin[g];
    return d[0].dart == back ? d[1].dart : d[0].dart;
  }
  if (traced.point_node[p] != kNone) {
    return kNone;
  }
  for (const std::uint32_t d : a.point_darts[p]) {
    if (d != kNone && d != back) {
      return d;
    }
  }
  throw InternalError("a line passes through a point that is no node");
}

std::int64_t fixed_length(const Vec3d& a, const Vec3d& b, double scale) {
  const Vec3d d = b - a;
  const double length = std::sqrt(d.x() * d.x() + d.y() * d.y() + d.z() * d.z()) * scale;
  return static_cast<std::int64_t>(std::floor(std::min(length, 1e15) + 0.5));
}

TracedTile trace_tile(const TileArrangement& a, std::span<const PointKey> cuts,
                      const TraceOptions& options) {
  return Tracer(a, cuts, options).run();
}

std::vector<ArcPoint> arc_polyline(const TileArrangement& a, const TracedTile& traced,
                                   std::uint32_t arc) {
  std::vector<ArcPoint> line;
  const std::uint32_t first = traced.arc_start[arc];
  std::uint32_t d = first;
  for (;;) {
    const std::uint32_t p = a.start(d);
    line.push_back({a.position(p), a.key(p), a.mesh->counts.first + a.segments[d >> 1].triangle});
    const std::uint32_t next = next_dart(a, traced, d);
    if (next == kNone || next == first) {
      const std::uint32_t q = a.end(d);
      line.push_back({a.position(q), a.key(q), line.back().triangle});
      return line;
    }
    d = next;
  }
}

}  // namespace rattan::layout
