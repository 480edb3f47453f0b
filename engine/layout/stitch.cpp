// SPDX-License-Identifier: MIT
#include "engine/layout/stitch.h"

#include <algorithm>
#include <tuple>

#include "engine/core/errors.h"
#include "engine/layout/boundary_corners.h"

namespace rattan::layout {

namespace {

class Stitcher {
 public:
  Stitcher(std::span<const TileGraph> tiles, std::span<const PointKey> cuts,
           const TraceOptions& options)
      : tiles_(tiles), cuts_(cuts), options_(options) {}

  Skeleton run() {
    number();
    merge_nodes();
    copy_arcs();
    join_border();
    rotate();
    count_vertices();
    peel();
    compact();
    find_essential();
    find_strands();
    if (keep_true_corners(k_, options_)) {
      find_essential();
      find_strands();
    }
    drop_circles();
    mark_faces();
    return std::move(k_);
  }

 private:
  void number() {
    k_.face_base.assign(1, 0);
    k_.arc_base.assign(1, 0);
    node_base_.assign(1, 0);
    std::uint64_t faces = 0;
    std::uint64_t arcs = 0;
    std::uint64_t nodes = 0;
    for (const TileGraph& g : tiles_) {
      faces += g.face_count();
      arcs += g.arcs.size();
      nodes += g.nodes.size();
      ensure(faces < kNone && 2 * arcs < kNone && nodes < kNone, "the output fits 32-bit numbers");
      k_.face_base.push_back(static_cast<std::uint32_t>(faces));
      k_.arc_base.push_back(static_cast<std::uint32_t>(arcs));
      node_base_.push_back(static_cast<std::uint32_t>(nodes));
    }
    k_.faces = DisjointSets(faces);
    k_.euler.reserve(faces);
    k_.singular.reserve(faces);
    for (const TileGraph& g : tiles_) {
      k_.euler.insert(k_.euler.end(), g.euler.begin(), g.euler.end());
      k_.singular.insert(k_.singular.end(), g.singular.begin(), g.singular.end());
    }
  }

  void merge_faces(std::uint32_t f, std::uint32_t g, std::int64_t change) {
    f = k_.faces.find(f);
    g = k_.faces.find(g);
    if (f != g) {
      const std::int64_t sum = k_.euler[f] + k_.euler[g];
      const auto singular = static_cast<std::uint8_t>(k_.singular[f] | k_.singular[g]);
      k_.faces.unite(f, g);
      f = k_.faces.find(f);
      k_.euler[f] = sum;
      k_.singular[f] = singular;
    }
    k_.euler[f] += change;
  }

  /// Nodes of several tiles with one key become one; the lowest number stands for all.
  void merge_nodes() {
    k_.nodes.reserve(node_base_.back());
    std::vector<std::uint32_t> shared;
    for (std::size_t t = 0; t < tiles_.size(); ++t) {
      for (const GraphNode& n : tiles_[t].nodes) {
        if (!n.key.in_triangle()) {
          shared.push_back(static_cast<std::uint32_t>(k_.nodes.size()));
        }
        k_.nodes.push_back(n);
        if (n.face != kNone) {
          k_.nodes.back().face += k_.face_base[t];
        }
      }
    }
    std::sort(shared.begin(), shared.end(), [&](std::uint32_t x, std::uint32_t y) {
      return std::tie(k_.nodes[x].key, x) < std::tie(k_.nodes[y].key, y);
    });
    same_.resize(k_.nodes.size());
    for (std::uint32_t i = 0; i < same_.size(); ++i) {
      same_[i] = i;
    }
    for (std::size_t i = 1; i < shared.size(); ++i) {
      const std::uint32_t before = same_[shared[i - 1]];
      if (k_.nodes[before].key == k_.nodes[shared[i]].key) {
        GraphNode& to = k_.nodes[before];
        const GraphNode& from = k_.nodes[shared[i]];
        same_[shared[i]] = before;
        to.flags |= from.flags;
        to.triangle = std::min(to.triangle, from.triangle);
      }
    }
  }

  void copy_arcs() {
    k_.arcs.reserve(k_.arc_base.back());
    slots_.reserve(2 * std::size_t{k_.arc_base.back()});
    for (std::uint32_t t = 0; t < tiles_.size(); ++t) {
      const std::uint32_t faces = k_.face_base[t];
      for (std::uint32_t i = 0; i < tiles_[t].arcs.size(); ++i) {
        const GraphArc& a = tiles_[t].arcs[i];
        SkeletonArc s;
        for (std::size_t e = 0; e < 2; ++e) {
          s.node[e] = a.node[e] == kNone ? kNone : same_[node_base_[t] + a.node[e]];
          slots_.push_back(a.slot[e]);
        }
        s.left = a.left + faces;
        s.right = a.right == kNone ? kNone : a.right + faces;
        s.tile = t;
        s.index = i;
        s.length = a.length;
        s.cut = a.cut;
        s.feature = a.feature;
        k_.arcs.push_back(s);
      }
    }
  }

  bool is_cut(std::uint64_t lo, std::uint64_t hi, std::uint32_t i) const {
    return std::binary_search(cuts_.begin(), cuts_.end(), PointKey{lo, hi, i});
  }

  /// The two sides of every rim edge: their faces are one across each piece, unless it is cut; an
  /// edge that came once is boundary.
  void join_border() {
    struct Side {
      const BorderEdge* edge;
      std::uint32_t tile;
    };
    std::vector<Side> sides;
    for (std::uint32_t t = 0; t < tiles_.size(); ++t) {
      for (const BorderEdge& b : tiles_[t].border_edges) {
        sides.push_back({&b, t});
      }
    }
    std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) {
      return std::tie(x.edge->lo, x.edge->hi, x.tile) < std::tie(y.edge->lo, y.edge->hi, y.tile);
    });
    const auto label = [&](const Side& s, std::uint32_t i) {
      return tiles_[s.tile].border_labels[s.edge->first_label + i] + k_.face_base[s.tile];
    };
    const auto node = [&](const Side& s, std::uint32_t local) {
      ensure(local != kNone, "ends of a rim piece on the graph are nodes");
      return same_[node_base_[s.tile] + local];
    };
    // Node before piece i, counted from lo; i = points + 1 asks for hi.
    const auto end = [&](const Side& s, std::uint32_t i) {
      return i == 0                    ? node(s, s.edge->lo_node)
             : i == s.edge->points + 1 ? node(s, s.edge->hi_node)
                                       : node(s, s.edge->first_node + i - 1);
    };
    const auto add_piece = [&](const Side& s, std::uint32_t i, bool forward, std::uint32_t left,
                               std::uint32_t right, std::uint64_t triangle) {
      SkeletonArc a;
      const std::uint32_t low = end(s, i);
      const std::uint32_t high = end(s, i + 1);
      const std::uint64_t low_slot = i == 0 ? vertex_slot(s.edge->hi, 0) : 0;
      const std::uint64_t high_slot = i == s.edge->points ? vertex_slot(s.edge->lo, 0) : 2;
      a.node = forward ? std::array{low, high} : std::array{high, low};
      slots_.push_back(forward ? low_slot : high_slot);
      slots_.push_back(forward ? high_slot : low_slot);
      a.left = left;
      a.right = right;
      a.triangle = triangle;
      a.length =
          fixed_length(k_.nodes[low].position, k_.nodes[high].position, options_.length_scale);
      a.piece = PointKey::on_edge(s.edge->lo, s.edge->hi, i);
      a.feature = right != kNone && s.edge->feature;
      a.cut = right != kNone && !s.edge->feature;
      for (const std::uint32_t n : a.node) {
        k_.nodes[n].triangle = std::min(k_.nodes[n].triangle, triangle);
      }
      k_.arcs.push_back(a);
    };
    for (std::size_t at = 0; at < sides.size();) {
      const Side& s = sides[at];
      const bool paired = at + 1 < sides.size() && sides[at + 1].edge->lo == s.edge->lo &&
                          sides[at + 1].edge->hi == s.edge->hi;
      if (!paired) {
        ensure(s.edge->maybe_boundary, "both sides of a tile's rim are known");
        for (std::uint32_t i = 0; i <= s.edge->points; ++i) {
          add_piece(s, i, s.edge->left, label(s, i), kNone, s.edge->triangle);
        }
        ++at;
        continue;
      }
      const Side& o = sides[at + 1];
      ensure(s.edge->points == o.edge->points && s.edge->left != o.edge->left,
             "both sides of an edge see the same crossings");
      const Side& left = s.edge->left ? s : o;
      const Side& right = s.edge->left ? o : s;
      for (std::uint32_t i = 0; i <= s.edge->points; ++i) {
        if (s.edge->feature || is_cut(s.edge->lo, s.edge->hi, i)) {
          add_piece(s, i, true, label(left, i), label(right, i),
                    std::min(s.edge->triangle, o.edge->triangle));
        } else {
          merge_faces(label(left, i), label(right, i), -1);
        }
      }
      at += 2;
    }
    ensure(2 * k_.arcs.size() < kNone, "the output fits 32-bit numbers");
  }

  /// Darts around every node, counter-clockwise.
  void rotate() {
    k_.dart_begin.assign(k_.nodes.size() + 1, 0);
    for (const SkeletonArc& a : k_.arcs) {
      for (const std::uint32_t n : a.node) {
        if (n != kNone) {
          ++k_.dart_begin[n + 1];
        }
      }
    }
    for (std::size_t n = 0; n < k_.nodes.size(); ++n) {
      k_.dart_begin[n + 1] += k_.dart_begin[n];
    }
    k_.darts.resize(k_.dart_begin.back());
    std::vector<std::uint32_t> at(k_.dart_begin.begin(), k_.dart_begin.end() - 1);
    for (std::uint32_t d = 0; d < 2 * k_.arcs.size(); ++d) {
      const std::uint32_t n = k_.start(d);
      if (n != kNone) {
        k_.darts[at[n]++] = d;
      }
    }
    std::vector<FanEntry> fans;
    for (const TileGraph& g : tiles_) {
      fans.insert(fans.end(), g.fans.begin(), g.fans.end());
    }
    const auto by_spoke = [](const FanEntry& x, const FanEntry& y) {
      return std::tie(x.vertex, x.neighbor) < std::tie(y.vertex, y.neighbor);
    };
    std::sort(fans.begin(), fans.end(), by_spoke);
    for (std::uint32_t n = 0; n < k_.nodes.size(); ++n) {
      const auto first = k_.darts.begin() + k_.dart_begin[n];
      const auto last = k_.darts.begin() + k_.dart_begin[n + 1];
      if (last - first < 2) {
        continue;
      }
      const PointKey& key = k_.nodes[n].key;
      if (key.is_vertex() && last - first > 2) {
        // Turn neighbours into ranks; two darts are in cyclic order anyway.
        for (auto d = first; d != last; ++d) {
          const FanEntry wanted{key.a, slot_neighbor(slots_[*d]), 0};
          const auto e = std::lower_bound(fans.begin(), fans.end(), wanted, by_spoke);
          ensure(e != fans.end() && e->vertex == key.a && e->neighbor == wanted.neighbor,
                 "the rotation about every cut vertex is known");
          slots_[*d] = vertex_slot(e->rank, static_cast<std::uint32_t>(slots_[*d] & 7U));
        }
      }
      std::sort(first, last,
                [&](std::uint32_t x, std::uint32_t y) { return slots_[x] < slots_[y]; });
    }
  }

  /// Points of rim edges and scan vertices on the rim that are off the graph.
  void count_vertices() {
    std::vector<std::uint64_t> on_graph;
    for (std::uint32_t n = 0; n < k_.nodes.size(); ++n) {
      if (same_[n] != n) {
        continue;
      }
      if (k_.nodes[n].key.is_vertex()) {
        if (k_.degree(n) > 0) {
          on_graph.push_back(k_.nodes[n].key.a);
        }
      } else if (k_.degree(n) == 0) {
        ++k_.euler[k_.faces.find(k_.nodes[n].face)];
      }
    }
    std::sort(on_graph.begin(), on_graph.end());
    std::vector<BorderVertex> vertices;
    for (std::size_t t = 0; t < tiles_.size(); ++t) {
      for (const BorderVertex& v : tiles_[t].border_vertices) {
        vertices.push_back({v.vertex, v.face + k_.face_base[t]});
      }
    }
    std::sort(vertices.begin(), vertices.end(), [](const BorderVertex& x, const BorderVertex& y) {
      return std::tie(x.vertex, x.face) < std::tie(y.vertex, y.face);
    });
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const bool again = i > 0 && vertices[i - 1].vertex == vertices[i].vertex;
      if (!again && !std::binary_search(on_graph.begin(), on_graph.end(), vertices[i].vertex)) {
        ++k_.euler[k_.faces.find(vertices[i].face)];
      }
    }
  }

  /// Removes paths that end nowhere, but for features that have a corner there. An open arc counts
  /// -1, a freed point +1.
  void peel() {
    std::vector<std::uint32_t> degree(k_.nodes.size());
    std::vector<std::uint32_t> stack;
    for (std::uint32_t n = 0; n < k_.nodes.size(); ++n) {
      degree[n] = k_.degree(n);
      if (degree[n] == 1) {
        stack.push_back(n);
        ++k_.counts.dangling_ends;
      }
    }
    while (!stack.empty()) {
      const std::uint32_t n = stack.back();
      stack.pop_back();
      if (degree[n] != 1 || ends_feature(n)) {
        continue;
      }
      for (std::uint32_t i = k_.dart_begin[n]; i < k_.dart_begin[n + 1]; ++i) {
        SkeletonArc& a = k_.arcs[k_.darts[i] >> 1];
        if (!a.alive) {
          continue;
        }
        a.alive = false;
        ensure(a.right != kNone && k_.faces.find(a.left) == k_.faces.find(a.right),
               "a dangling path has one face around it");
        std::int64_t& euler = k_.euler[k_.faces.find(a.left)];
        --euler;
        for (const std::uint32_t end : a.node) {
          --degree[end];
          if (degree[end] == 0) {
            ++euler;
          } else if (degree[end] == 1) {
            stack.push_back(end);
          }
        }
      }
    }
  }

  /// The one arc that is left at the node is a feature's that keeps its end.
  bool ends_feature(std::uint32_t n) const {
    if ((k_.nodes[n].flags & kFeatureCornerNode) == 0) {
      return false;
    }
    for (std::uint32_t i = k_.dart_begin[n]; i < k_.dart_begin[n + 1]; ++i) {
      const SkeletonArc& a = k_.arcs[k_.darts[i] >> 1];
      if (a.alive && a.feature) {
        return true;
      }
    }
    return false;
  }

  void compact() {
    std::vector<std::uint32_t> begin(k_.nodes.size() + 1, 0);
    std::uint32_t kept = 0;
    k_.dart_place.assign(2 * k_.arcs.size(), kNone);
    for (std::uint32_t n = 0; n < k_.nodes.size(); ++n) {
      begin[n] = kept;
      for (std::uint32_t i = k_.dart_begin[n]; i < k_.dart_begin[n + 1]; ++i) {
        if (k_.arcs[k_.darts[i] >> 1].alive) {
          k_.dart_place[k_.darts[i]] = kept;
          k_.darts[kept++] = k_.darts[i];
        }
      }
    }
    begin[k_.nodes.size()] = kept;
    k_.darts.resize(kept);
    k_.dart_begin = std::move(begin);
  }

  void find_essential() {
    k_.essential.clear();
    k_.is_essential.assign(k_.nodes.size(), 0);
    for (std::uint32_t n = 0; n < k_.nodes.size(); ++n) {
      const std::uint32_t degree = k_.degree(n);
      if (degree > 2 || degree == 1 || (degree == 2 && k_.nodes[n].flags != 0)) {
        k_.is_essential[n] = 1;
        k_.essential.push_back(n);
      }
    }
    std::sort(k_.essential.begin(), k_.essential.end(),
              [&](std::uint32_t x, std::uint32_t y) { return k_.nodes[x].key < k_.nodes[y].key; });
  }

  void add_strand(std::uint32_t first) {
    Strand s;
    s.first = first;
    s.boundary = k_.arcs[first >> 1].right == kNone;
    s.closed = true;
    for (std::uint32_t d = first;;) {
      used_[d >> 1] = 1;
      s.last = d;
      s.length += k_.arcs[d >> 1].length;
      s.cut = s.cut || k_.arcs[d >> 1].cut;
      s.feature = s.feature || k_.arcs[d >> 1].feature;
      d = k_.next_on_strand(d);
      if (d == kNone) {
        s.closed = false;
        break;
      }
      if (d == first) {
        break;
      }
    }
    k_.strands.push_back(s);
  }

  void find_strands() {
    k_.strands.clear();
    used_.assign(k_.arcs.size(), 0);
    for (const std::uint32_t n : k_.essential) {
      for (std::uint32_t i = k_.dart_begin[n]; i < k_.dart_begin[n + 1]; ++i) {
        const std::uint32_t d = k_.darts[i];
        const bool outside = (d & 1U) != 0 && k_.arcs[d >> 1].right == kNone;
        if (used_[d >> 1] == 0 && !outside) {
          add_strand(d);
        }
      }
    }
    for (std::uint32_t a = 0; a < k_.arcs.size(); ++a) {
      if (k_.arcs[a].alive && used_[a] == 0) {
        add_strand(2 * a);
      }
    }
  }

  /// A closed line without a node that bounds a disk says nothing; dropping it may turn the face
  /// around it into a disk, and so on. Cuts stay.
  void drop_circles() {
    const auto droppable = [&](const Strand& s) {
      if (!s.closed || s.boundary || s.cut || s.feature) {
        return false;
      }
      const std::uint32_t left = k_.left(s.first);
      const std::uint32_t right = k_.left(s.first ^ 1U);
      return left != right && (k_.euler[left] == 1 || k_.euler[right] == 1);
    };
    for (bool changed = true; changed;) {
      changed = false;
      std::size_t kept = 0;
      for (const Strand& s : k_.strands) {
        if (!droppable(s)) {
          k_.strands[kept++] = s;
          continue;
        }
        changed = true;
        ++k_.counts.dropped_circles;
        merge_faces(k_.left(s.first), k_.left(s.first ^ 1U), 0);
        for (std::uint32_t d = s.first;;) {
          k_.arcs[d >> 1].alive = false;
          d = k_.next_on_strand(d);
          if (d == s.first) {
            break;
          }
        }
      }
      k_.strands.resize(kept);
    }
  }

  void mark_faces() {
    k_.has_graph.assign(k_.euler.size(), 0);
    for (const SkeletonArc& a : k_.arcs) {
      if (a.alive) {
        k_.has_graph[k_.faces.find(a.left)] = 1;
        if (a.right != kNone) {
          k_.has_graph[k_.faces.find(a.right)] = 1;
        }
      }
    }
  }

  std::span<const TileGraph> tiles_;
  std::span<const PointKey> cuts_;
  TraceOptions options_;
  Skeleton k_;
  std::vector<std::uint32_t> node_base_;
  std::vector<std::uint32_t> same_;
  std::vector<std::uint64_t> slots_;  // one a dart
  std::vector<std::uint8_t> used_;
};

}  // namespace

std::uint32_t Skeleton::next_on_strand(std::uint32_t dart) const {
  const std::uint32_t n = end(dart);
  if (n == kNone) {
    return dart;  // closed in one arc
  }
  if (is_essential[n] != 0) {
    return kNone;
  }
  const std::uint32_t first = darts[dart_begin[n]];
  return first == (dart ^ 1U) ? darts[dart_begin[n] + 1] : first;
}

std::uint32_t Skeleton::next_around(std::uint32_t dart) const {
  const std::uint32_t n = end(dart);
  if (n == kNone) {
    return dart;
  }
  const std::uint32_t place = dart_place[dart ^ 1U];
  return place == dart_begin[n] ? darts[dart_begin[n + 1] - 1] : darts[place - 1];
}

Skeleton stitch(std::span<const TileGraph> tiles, std::span<const PointKey> cuts,
                const TraceOptions& options) {
  return Stitcher(tiles, cuts, options).run();
}

}  // namespace rattan::layout
