// SPDX-License-Identifier: MIT
//
// Based on: Eppstein, Dynamic generators of topologically embedded graphs (2003), and Erickson and
// Whittlesey, Greedy optimal homotopy and homology generators (2005); the face's border is
// contracted to one root.
#include "engine/layout/face_cuts.h"

#include <algorithm>
#include <limits>
#include <queue>
#include <tuple>
#include <utility>

#include "engine/core/errors.h"
#include "engine/layout/disjoint_sets.h"

namespace rattan::layout {

namespace {

/// A dropped line follows the field, a scan edge nothing: prefer the former.
constexpr double kLineWeight = 0.5;
constexpr std::uint32_t kSeeds = 6;

}  // namespace

std::vector<FaceSegment> face_segments(const TileArrangement& a, const TracedTile& traced,
                                       std::span<const std::uint8_t> wanted_faces,
                                       std::span<const std::uint8_t> arc_alive,
                                       std::span<const PointKey> loose) {
  const TileCoordinates& c = *a.coordinates;
  std::vector<FaceSegment> out;
  const auto alive = [&](std::uint32_t dart) {
    return dart != kNone && arc_alive[traced.arc_of_segment[dart >> 1]] != 0;
  };
  const auto any_alive = [&](const std::array<std::uint32_t, 4>& darts) {
    return std::any_of(darts.begin(), darts.end(), alive);
  };
  const auto vertex_on_graph = [&](std::uint32_t v) {
    const std::uint32_t g = a.graph_vertex[v];
    if (g == kNone) {
      return false;
    }
    for (std::uint32_t i = traced.vertex_begin[g]; i < traced.vertex_begin[g + 1]; ++i) {
      if (alive(a.vertex_darts[i].dart)) {
        return true;
      }
    }
    return a.vertices[g].boundary;
  };
  const auto point_on_graph = [&](std::uint32_t p) {
    if ((p & kVertexTag) != 0) {
      return vertex_on_graph(a.vertices[p & ~kTagMask].vertex);
    }
    return any_alive((p & kCrossingTag) != 0 ? a.crossings[p & ~kTagMask].darts : a.point_darts[p]);
  };
  // Pieces of features belong to the graph unless they were peeled off.
  const auto is_loose = [&](std::uint32_t e, std::uint32_t i) {
    if (a.place[e] != EdgePlace::kInside) {
      return std::binary_search(loose.begin(), loose.end(),
                                PointKey::on_edge(c.ids[c.edges[e].lo], c.ids[c.edges[e].hi], i));
    }
    const std::uint32_t n = a.points_on(e);
    if (i < n) {
      return !alive(a.point_darts[a.point_begin[e] + i][2]);
    }
    if (n > 0) {
      return !alive(a.point_darts[a.point_begin[e] + n - 1][0]);
    }
    const std::uint32_t g = a.graph_vertex[c.edges[e].lo];
    for (std::uint32_t k = traced.vertex_begin[g]; k < traced.vertex_begin[g + 1]; ++k) {
      if (a.vertex_darts[k].neighbor == c.edges[e].hi && a.vertex_darts[k].line == 0) {
        return !alive(a.vertex_darts[k].dart);
      }
    }
    return false;
  };
  const auto cell_key = [&](std::uint32_t cell) {
    const auto after = std::upper_bound(a.cell_begin.begin(), a.cell_begin.end(), cell);
    const auto t = static_cast<std::uint32_t>(after - a.cell_begin.begin() - 1);
    return CellKey{a.mesh->counts.first + t, cell - a.cell_begin[t]};
  };
  for (std::uint32_t e = 0; e < a.place.size(); ++e) {
    if (a.place[e] == EdgePlace::kOutside || a.place[e] == EdgePlace::kBoundary) {
      continue;
    }
    const TileEdge& edge = c.edges[e];
    const std::uint32_t n = a.points_on(e);
    for (std::uint32_t i = 0; i <= n; ++i) {
      const std::uint32_t piece = a.piece(e, i);
      const bool has_left = a.left_cell[piece] != kNone;
      const std::uint32_t cell = has_left ? a.left_cell[piece] : a.right_cell[piece];
      const std::uint32_t face = traced.face_of_cell[cell];
      if (wanted_faces[face] == 0 || a.piece_cut[piece] == kCutPiece ||
          (a.piece_cut[piece] == kFeaturePiece && !is_loose(e, i))) {
        continue;
      }
      FaceSegment s;
      s.key = PointKey::on_edge(c.ids[edge.lo], c.ids[edge.hi], i);
      s.face = face;
      s.cells[0] = cell_key(cell);
      s.cell_count = 1;
      if (a.place[e] == EdgePlace::kInside) {
        s.cells[1] = cell_key(a.right_cell[piece]);
        s.cell_count = 2;
      }
      Vec3d low = a.vertex_position(edge.lo);
      Vec3d high = a.vertex_position(edge.hi);
      s.ends = {PointKey::vertex(c.ids[edge.lo]), PointKey::vertex(c.ids[edge.hi])};
      s.on_graph = {false, false};
      if (i > 0) {
        const std::uint32_t p = a.point_begin[e] + i - 1;
        s.ends[0] = a.key(p);
        s.on_graph[0] = point_on_graph(p);
        low = a.position(p);
      } else {
        s.on_graph[0] = vertex_on_graph(edge.lo);
      }
      if (i < n) {
        const std::uint32_t p = a.point_begin[e] + i;
        s.ends[1] = a.key(p);
        s.on_graph[1] = point_on_graph(p);
        high = a.position(p);
      } else {
        s.on_graph[1] = vertex_on_graph(edge.hi);
      }
      s.length = (high - low).norm();
      out.push_back(s);
    }
  }
  std::uint32_t first_of_triangle = 0;
  for (std::uint32_t i = 0; i < a.first_edge_segment; ++i) {
    const Segment& g = a.segments[i];
    if (g.triangle != a.segments[first_of_triangle].triangle) {
      first_of_triangle = i;
    }
    const std::uint32_t face = traced.face_of_cell[g.left];
    if (wanted_faces[face] == 0 || alive(2 * i)) {
      continue;
    }
    FaceSegment s;
    s.key = {PointKey::kInTriangle | (a.mesh->counts.first + g.triangle), 1, i - first_of_triangle};
    s.ends = {a.key(g.from), a.key(g.to)};
    s.on_graph = {point_on_graph(g.from), point_on_graph(g.to)};
    s.cells = {cell_key(g.left), cell_key(g.right)};
    s.cell_count = 2;
    s.face = face;
    s.length = (a.position(g.to) - a.position(g.from)).norm();
    out.push_back(s);
  }
  return out;
}

namespace {

class Cutter {
 public:
  Cutter(std::vector<FaceSegment> segments, std::span<const std::uint8_t> bare)
      : all_(std::move(segments)), bare_(bare) {}

  std::vector<FaceCut> run() {
    merge();
    number();
    spread_seeds();
    grow_trees();
    cut_rest();
    return collect();
  }

 private:
  struct Link {
    std::uint32_t segment;
    std::uint32_t to;
  };

  /// Brings the two halves of rim pieces together; halves alone lie on the boundary.
  void merge() {
    std::sort(all_.begin(), all_.end(), [](const FaceSegment& x, const FaceSegment& y) {
      return std::tie(x.key, x.cells[0]) < std::tie(y.key, y.cells[0]);
    });
    for (std::size_t i = 0; i < all_.size();) {
      FaceSegment s = all_[i];
      std::vector<std::uint32_t> seen{s.tile};
      std::size_t j = i + 1;
      for (; j < all_.size() && all_[j].key == s.key; ++j) {
        s.cells[1] = all_[j].cells[0];
        ++s.cell_count;
        for (std::size_t e = 0; e < 2; ++e) {
          s.on_graph[e] = s.on_graph[e] || all_[j].on_graph[e];
        }
        seen.push_back(all_[j].tile);
      }
      if (s.cell_count == 2) {
        segments_.push_back(s);
        tiles_.push_back(std::move(seen));
      }
      i = j;
    }
    all_.clear();
  }

  void number() {
    for (const FaceSegment& s : segments_) {
      points_.insert(points_.end(), s.ends.begin(), s.ends.end());
      cells_.insert(cells_.end(), s.cells.begin(), s.cells.end());
    }
    std::sort(points_.begin(), points_.end());
    points_.erase(std::unique(points_.begin(), points_.end()), points_.end());
    std::sort(cells_.begin(), cells_.end());
    cells_.erase(std::unique(cells_.begin(), cells_.end()), cells_.end());
    on_graph_.assign(points_.size(), 0);
    for (const FaceSegment& s : segments_) {
      for (std::size_t e = 0; e < 2; ++e) {
        on_graph_[point(s, e)] |= s.on_graph[e] ? 1 : 0;
      }
    }
    cut_.assign(segments_.size(), 0);
  }

  std::uint32_t point(const FaceSegment& s, std::size_t e) const {
    return static_cast<std::uint32_t>(std::lower_bound(points_.begin(), points_.end(), s.ends[e]) -
                                      points_.begin());
  }
  std::uint32_t cell(const FaceSegment& s, std::size_t e) const {
    return static_cast<std::uint32_t>(std::lower_bound(cells_.begin(), cells_.end(), s.cells[e]) -
                                      cells_.begin());
  }

  /// Links of a graph over `nodes` numbers, by node.
  template <class Ends>
  void link(std::size_t nodes, const Ends& ends, std::vector<std::uint32_t>& begin,
            std::vector<Link>& links) const {
    begin.assign(nodes + 1, 0);
    for (int pass = 0; pass < 2; ++pass) {
      std::vector<std::uint32_t> at(begin.begin(), begin.end() - 1);
      for (std::uint32_t i = 0; i < segments_.size(); ++i) {
        const auto [use, x, y] = ends(i);
        if (!use) {
          continue;
        }
        if (pass == 0) {
          ++begin[x + 1];
          ++begin[y + 1];
        } else {
          links[at[x]++] = {i, y};
          links[at[y]++] = {i, x};
        }
      }
      if (pass == 0) {
        for (std::size_t n = 0; n < nodes; ++n) {
          begin[n + 1] += begin[n];
        }
        links.resize(begin[nodes]);
      }
    }
  }

  /// Divides every bare component: cells joined across dropped lines, farthest-point seeds, and
  /// cuts where the seeds' realms meet.
  void spread_seeds() {
    std::vector<std::uint32_t> first_cells;  // lowest cell of each bare face
    DisjointSets groups(cells_.size());
    std::vector<std::uint8_t> in_bare(cells_.size(), 0);
    for (const FaceSegment& s : segments_) {
      if (bare_[s.face] != 0) {
        in_bare[cell(s, 0)] = in_bare[cell(s, 1)] = 1;
        if (!s.is_piece()) {
          groups.unite(cell(s, 0), cell(s, 1));
        }
      }
    }
    std::vector<std::uint32_t> begin;
    std::vector<Link> links;
    link(
        cells_.size(),
        [&](std::uint32_t i) {
          const FaceSegment& s = segments_[i];
          const bool use = bare_[s.face] != 0 && s.is_piece();
          return std::tuple{use, use ? groups.find(cell(s, 0)) : 0,
                            use ? groups.find(cell(s, 1)) : 0};
        },
        begin, links);
    std::vector<std::uint32_t> realm(cells_.size(), kNone);
    std::vector<std::uint32_t> distance(cells_.size(), kNone);
    std::vector<std::uint32_t> queue;
    // Breadth first from one seed, claiming whatever is nearer to it than to those before.
    const auto claim = [&](std::uint32_t seed) {
      queue.assign(1, seed);
      realm[seed] = seed;
      distance[seed] = 0;
      for (std::size_t at = 0; at < queue.size(); ++at) {
        const std::uint32_t x = queue[at];
        for (std::uint32_t l = begin[x]; l < begin[x + 1]; ++l) {
          const std::uint32_t y = links[l].to;
          if (distance[y] == kNone || distance[y] > distance[x] + 1) {
            distance[y] = distance[x] + 1;
            realm[y] = seed;
            queue.push_back(y);
          }
        }
      }
    };
    for (std::uint32_t first = 0; first < cells_.size(); ++first) {
      if (in_bare[first] == 0 || groups.find(first) != first || realm[first] != kNone) {
        continue;
      }
      claim(first);
      std::vector<std::uint32_t> component = queue;
      std::sort(component.begin(), component.end());
      component.erase(std::unique(component.begin(), component.end()), component.end());
      for (std::uint32_t seeds = 1; seeds < kSeeds; ++seeds) {
        std::uint32_t farthest = first;
        for (const std::uint32_t x : component) {
          if (distance[x] > distance[farthest]) {
            farthest = x;
          }
        }
        if (distance[farthest] == 0) {
          break;
        }
        claim(farthest);
      }
    }
    for (std::uint32_t i = 0; i < segments_.size(); ++i) {
      const FaceSegment& s = segments_[i];
      if (bare_[s.face] != 0 && s.is_piece() &&
          realm[groups.find(cell(s, 0))] != realm[groups.find(cell(s, 1))]) {
        cut_[i] = 1;
      }
    }
  }

  double weight(const FaceSegment& s) const {
    return s.length * (s.is_piece() ? 1.0 : kLineWeight);
  }

  /// Shortest paths from the graph into the faces; segments on them are not crossed by the dual
  /// tree.
  void grow_trees() {
    std::vector<std::uint32_t> begin;
    std::vector<Link> links;
    link(
        points_.size(),
        [&](std::uint32_t i) {
          const FaceSegment& s = segments_[i];
          return std::tuple{bare_[s.face] == 0, point(s, 0), point(s, 1)};
        },
        begin, links);
    distance_.assign(points_.size(), std::numeric_limits<double>::infinity());
    parent_.assign(points_.size(), {kNone, kNone});
    using Entry = std::pair<double, std::uint32_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    for (std::uint32_t p = 0; p < points_.size(); ++p) {
      if (on_graph_[p] != 0) {
        distance_[p] = 0.0;
        queue.push({0.0, p});
      }
    }
    std::vector<std::uint8_t> done(points_.size(), 0);
    while (!queue.empty()) {
      const std::uint32_t p = queue.top().second;
      queue.pop();
      if (done[p] != 0) {
        continue;
      }
      done[p] = 1;
      for (std::uint32_t l = begin[p]; l < begin[p + 1]; ++l) {
        const std::uint32_t q = links[l].to;
        const double d = distance_[p] + weight(segments_[links[l].segment]);
        if (done[q] == 0 && on_graph_[q] == 0 && d < distance_[q]) {
          distance_[q] = d;
          parent_[q] = {links[l].segment, p};
          queue.push({d, q});
        }
      }
    }
  }

  /// The dual tree crosses what is neither on a path nor needed as a cut, the longest loops first;
  /// what it cannot cross without closing a cycle is cut, with the paths from both ends.
  void cut_rest() {
    std::vector<std::uint8_t> in_tree(segments_.size(), 0);
    for (const auto& [segment, from] : parent_) {
      if (segment != kNone) {
        in_tree[segment] = 1;
      }
    }
    std::vector<std::pair<double, std::uint32_t>> order;
    for (std::uint32_t i = 0; i < segments_.size(); ++i) {
      const FaceSegment& s = segments_[i];
      if (bare_[s.face] == 0 && in_tree[i] == 0) {
        const double loop = distance_[point(s, 0)] + weight(s) + distance_[point(s, 1)];
        ensure(loop < std::numeric_limits<double>::infinity(), "a face reaches its border");
        order.push_back({-loop, i});
      }
    }
    std::sort(order.begin(), order.end());
    DisjointSets dual(cells_.size());
    for (const auto& [loop, i] : order) {
      const FaceSegment& s = segments_[i];
      if (dual.unite(cell(s, 0), cell(s, 1))) {
        continue;
      }
      cut_[i] = 1;
      for (std::size_t e = 0; e < 2; ++e) {
        for (std::uint32_t p = point(s, e); parent_[p].segment != kNone; p = parent_[p].to) {
          cut_[parent_[p].segment] = 1;
        }
      }
    }
  }

  /// Stretches of dropped lines come back by themselves once pieces hold both their ends.
  std::vector<FaceCut> collect() {
    std::vector<FaceCut> cuts;
    for (std::uint32_t i = 0; i < segments_.size(); ++i) {
      if (cut_[i] != 0 && segments_[i].is_piece()) {
        cuts.push_back({segments_[i].key, std::move(tiles_[i])});
      }
    }
    return cuts;
  }

  std::vector<FaceSegment> all_;
  std::span<const std::uint8_t> bare_;
  std::vector<FaceSegment> segments_;
  std::vector<std::vector<std::uint32_t>> tiles_;
  std::vector<PointKey> points_;
  std::vector<CellKey> cells_;
  std::vector<std::uint8_t> on_graph_;
  std::vector<std::uint8_t> cut_;
  std::vector<double> distance_;
  std::vector<Link> parent_;
};

}  // namespace

std::vector<FaceCut> cut_faces(std::vector<FaceSegment> segments,
                               std::span<const std::uint8_t> bare) {
  return Cutter(std::move(segments), bare).run();
}

}  // namespace rattan::layout
