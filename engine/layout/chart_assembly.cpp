// SPDX-License-Identifier: MIT
#include "engine/layout/chart_assembly.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/core/errors.h"
#include "engine/layout/disjoint_sets.h"
#include "engine/param/triangle_coordinates.h"

namespace rattan::layout {

namespace {

/// Corners of a unit square after unfolding, up to rounding.
constexpr double kSquare = 1e-3;

class Assembler {
 public:
  Assembler(const ChartGraph& graph, std::span<const std::uint64_t> nodes, bool has_colours)
      : graph_(graph), nodes_(nodes), has_colours_(has_colours) {}

  std::vector<ChartMesh> run(std::uint32_t first, std::uint32_t last,
                             std::span<const PieceView> pieces) {
    unify_vertices(pieces);
    group(first, last, pieces);
    local_.assign(vertices_.size(), kNone);
    std::vector<ChartMesh> charts;
    charts.reserve(last - first);
    for (std::uint32_t c = first; c < last; ++c) {
      charts.push_back(
          assemble(c, std::span(triangles_)
                          .subspan(begin_[c - first], begin_[c - first + 1] - begin_[c - first])));
    }
    return charts;
  }

 private:
  struct Triangle {
    const PieceTriangle* piece = nullptr;
    std::array<std::uint32_t, 3> vertex{};  // unified
  };

  /// The same number in several tiles is one vertex; the first tile's is taken.
  void unify_vertices(std::span<const PieceView> pieces) {
    base_.assign(1, 0);
    for (const PieceView& p : pieces) {
      vertices_.insert(vertices_.end(), p.vertices.begin(), p.vertices.end());
      base_.push_back(static_cast<std::uint32_t>(vertices_.size()));
    }
    same_.resize(vertices_.size());
    for (std::uint32_t i = 0; i < same_.size(); ++i) {
      same_[i] = i;
    }
    if (pieces.size() < 2) {
      return;
    }
    std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
    order.reserve(vertices_.size());
    for (std::uint32_t i = 0; i < vertices_.size(); ++i) {
      order.emplace_back(vertices_[i].number, i);
    }
    std::sort(order.begin(), order.end());
    for (std::size_t i = 1; i < order.size(); ++i) {
      if (order[i].first == order[i - 1].first) {
        same_[order[i].second] = same_[order[i - 1].second];
      }
    }
  }

  void group(std::uint32_t first, std::uint32_t last, std::span<const PieceView> pieces) {
    begin_.assign(last - first + 1, 0);
    const auto range = [&](const PieceView& p) {
      const auto by_chart = [](const PieceTriangle& t, std::uint32_t c) { return t.chart < c; };
      const auto low = std::lower_bound(p.triangles.begin(), p.triangles.end(), first, by_chart);
      return std::span(low, std::lower_bound(low, p.triangles.end(), last, by_chart));
    };
    for (const PieceView& p : pieces) {
      for (const PieceTriangle& t : range(p)) {
        ++begin_[t.chart - first + 1];
      }
    }
    for (std::size_t i = 1; i < begin_.size(); ++i) {
      begin_[i] += begin_[i - 1];
    }
    triangles_.resize(begin_.back());
    std::vector<std::uint32_t> at(begin_.begin(), begin_.end() - 1);
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      for (const PieceTriangle& t : range(pieces[i])) {
        Triangle& g = triangles_[at[t.chart - first]++];
        g.piece = &t;
        for (std::size_t k = 0; k < 3; ++k) {
          g.vertex[k] = same_[base_[i] + t.vertex[k]];
        }
      }
    }
  }

  ChartMesh assemble(std::uint32_t chart, std::span<const Triangle> triangles) {
    match_sides(triangles);
    ChartMesh mesh;
    mesh.chart = chart;
    make_vertices(triangles, mesh);
    find_rim(triangles, mesh);
    unfold(triangles, mesh);
    return mesh;
  }

  /// Inner sides with the side opposite; counted by their start.
  void match_sides(std::span<const Triangle> triangles) {
    const auto n = static_cast<std::uint32_t>(triangles.size());
    std::vector<std::uint32_t>& used = scratch_;
    used.clear();
    for (const Triangle& t : triangles) {
      for (const std::uint32_t v : t.vertex) {
        if (local_[v] == kNone) {
          local_[v] = static_cast<std::uint32_t>(used.size());
          used.push_back(v);
        }
      }
    }
    leaving_begin_.assign(used.size() + 1, 0);
    for (const Triangle& t : triangles) {
      for (const std::uint32_t v : t.vertex) {
        ++leaving_begin_[local_[v] + 1];
      }
    }
    for (std::size_t i = 1; i < leaving_begin_.size(); ++i) {
      leaving_begin_[i] += leaving_begin_[i - 1];
    }
    leaving_.resize(3 * std::size_t{n});
    std::vector<std::uint32_t> at(leaving_begin_.begin(), leaving_begin_.end() - 1);
    for (std::uint32_t side = 0; side < 3 * n; ++side) {
      leaving_[at[local_[triangles[side / 3].vertex[side % 3]]]++] = side;
    }
    twin_.assign(3 * std::size_t{n}, kNone);
    for (std::uint32_t side = 0; side < 3 * n; ++side) {
      const Triangle& t = triangles[side / 3];
      if (t.piece->dart[side % 3] != kNone) {
        continue;
      }
      const std::uint32_t from = t.vertex[side % 3];
      const std::uint32_t end = t.vertex[(side % 3 + 1) % 3];
      for (std::uint32_t i = leaving_begin_[local_[end]]; i < leaving_begin_[local_[end] + 1];
           ++i) {
        const std::uint32_t other = leaving_[i];
        const Triangle& o = triangles[other / 3];
        if (o.vertex[(other % 3 + 1) % 3] == from && o.piece->dart[other % 3] == kNone) {
          twin_[side] = other;
          break;
        }
      }
      ensure(twin_[side] != kNone, "a chart's inner sides have triangles on both sides");
    }
    for (const std::uint32_t v : used) {
      local_[v] = kNone;
    }
  }

  /// Vertices are corners joined across inner sides, so that a chart that meets itself along a
  /// strand, or at a point, is open there.
  void make_vertices(std::span<const Triangle> triangles, ChartMesh& mesh) {
    const auto sides = static_cast<std::uint32_t>(3 * triangles.size());
    DisjointSets corners(sides);
    const auto next = [](std::uint32_t side) { return side % 3 == 2 ? side - 2 : side + 1; };
    for (std::uint32_t side = 0; side < sides; ++side) {
      if (twin_[side] != kNone && side < twin_[side]) {
        corners.unite(side, next(twin_[side]));
        corners.unite(next(side), twin_[side]);
      }
    }
    std::vector<std::uint32_t> vertex(sides);
    mesh.triangle.resize(triangles.size());
    mesh.dart.resize(triangles.size());
    mesh.step.resize(triangles.size());
    for (std::uint32_t side = 0; side < sides; ++side) {
      const Triangle& t = triangles[side / 3];
      const std::uint32_t root = corners.find(side);
      if (root == side) {
        vertex[side] = static_cast<std::uint32_t>(mesh.number.size());
        const PieceVertex& v = vertices_[t.vertex[side % 3]];
        mesh.number.push_back(v.number);
        mesh.position.push_back(v.position.cast<double>());
        if (has_colours_) {
          mesh.colour.push_back(v.colour);
        }
      }
      vertex[side] = vertex[root];
      mesh.triangle[side / 3][side % 3] = vertex[side];
      const PieceTriangle& p = *t.piece;
      const std::size_t k = side % 3;
      mesh.dart[side / 3][k] = p.dart[k];
      double step = -1.0;
      if (p.dart[k] != kNone && p.flags == 0 && p.turn[k] == kNoTurn) {
        const auto& a = p.coordinate[k];
        const auto& b = p.coordinate[(k + 1) % 3];
        step = std::max(std::abs(static_cast<double>(a[0]) - static_cast<double>(b[0])),
                        std::abs(static_cast<double>(a[1]) - static_cast<double>(b[1])));
      }
      mesh.step[side / 3][k] = step;
    }
    mesh.is_node.assign(mesh.number.size(), 0);
  }

  void find_rim(std::span<const Triangle> triangles, ChartMesh& mesh) {
    rim_.assign(mesh.number.size(), kNone);
    std::uint32_t rim_sides = 0;
    for (std::uint32_t side = 0; side < 3 * triangles.size(); ++side) {
      if (mesh.dart[side / 3][side % 3] == kNone) {
        continue;
      }
      const std::uint32_t v = mesh.triangle[side / 3][side % 3];
      ensure(rim_[v] == kNone, "a chart's border passes a vertex once");
      rim_[v] = side;
      ++rim_sides;
      mesh.is_node[v] = std::binary_search(nodes_.begin(), nodes_.end(), mesh.number[v]) ? 1 : 0;
    }
    const std::uint64_t inner = (3 * triangles.size() - rim_sides) / 2;
    ensure(mesh.number.size() + triangles.size() == inner + rim_sides + 1, "a chart is a disk");
    std::uint32_t walked = 0;
    std::uint32_t side = kNone;
    for (const std::uint32_t s : rim_) {
      side = side == kNone ? s : side;
    }
    ensure(side != kNone, "a chart has a border");
    const std::uint32_t first = side;
    do {
      side = rim_[mesh.triangle[side / 3][(side % 3 + 1) % 3]];
      ensure(side != kNone && ++walked <= rim_sides, "a chart's border is one loop");
    } while (side != first);
    ensure(walked == rim_sides, "a chart's border is one loop");
  }

  void unfold(std::span<const Triangle> triangles, ChartMesh& mesh) {
    const auto ring = graph_.ring(mesh.chart);
    if (ring.size() != 4 || graph_.sides(mesh.chart) != 4 ||
        graph_.chart_singular[mesh.chart] != 0) {
      return;
    }
    struct Place {
      bool known = false;
      std::uint32_t r = 0;
      double s = 0.0, t = 0.0;
    };
    std::vector<Place> place(triangles.size());
    const auto carried = [&](std::uint32_t triangle, std::size_t corner) {
      const auto& c = triangles[triangle].piece->coordinate[corner];
      double x = static_cast<double>(c[0]);
      double y = static_cast<double>(c[1]);
      quarter_turns(place[triangle].r, x, y);
      return Vec2d(x + place[triangle].s, y + place[triangle].t);
    };
    std::vector<std::uint32_t> queue{0};
    place[0].known = true;
    for (std::size_t i = 0; i < queue.size(); ++i) {
      const std::uint32_t t = queue[i];
      if ((triangles[t].piece->flags & kSingularPiece) != 0) {
        return;
      }
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t side = twin_[3 * t + k];
        if (side == kNone || place[side / 3].known) {
          continue;
        }
        const std::uint32_t o = side / 3;
        const std::uint8_t mine = triangles[t].piece->turn[k];
        const std::uint8_t others = triangles[o].piece->turn[side % 3];
        place[o].known = true;
        place[o].r =
            (place[t].r + (mine == kNoTurn || others == kNoTurn ? 0U : mine + 4U - others)) & 3U;
        const Vec2d gap = carried(t, k) - carried(o, (side % 3 + 1) % 3);
        place[o].s = std::floor(gap.x() + 0.5);
        place[o].t = std::floor(gap.y() + 0.5);
        queue.push_back(o);
      }
    }
    // The first side runs from (0, 0) to (1, 0).
    std::vector<Vec2d> uv(mesh.number.size(), Vec2d(0, 0));
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        uv[mesh.triangle[t][k]] = carried(t, k);
      }
    }
    const Vec2d zero(0, 0);
    std::array<Vec2d, 4> corner{zero, zero, zero, zero};
    for (const std::uint32_t side : rim_) {
      if (side == kNone) {
        continue;
      }
      const std::uint32_t v = mesh.triangle[side / 3][side % 3];
      if (mesh.is_node[v] != 0) {
        for (std::size_t i = 0; i < 4; ++i) {
          if (ring[i] == mesh.dart[side / 3][side % 3]) {
            corner[i] = uv[v];
          }
        }
      }
    }
    const Vec2d origin = corner[0];
    const Vec2d along = corner[1] - origin;
    const Vec2d up(-along.y(), along.x());
    for (Vec2d& x : uv) {
      const Vec2d d = x - origin;
      x = Vec2d(d.dot(along), d.dot(up));
    }
    const std::array<Vec2d, 4> square{Vec2d(0, 0), Vec2d(1, 0), Vec2d(1, 1), Vec2d(0, 1)};
    for (std::size_t i = 0; i < 4; ++i) {
      const Vec2d d = corner[i] - origin;
      if ((Vec2d(d.dot(along), d.dot(up)) - square[i]).norm() > kSquare) {
        return;
      }
    }
    mesh.unfolded = std::move(uv);
  }

  const ChartGraph& graph_;
  std::span<const std::uint64_t> nodes_;
  bool has_colours_;
  std::vector<PieceVertex> vertices_;  // of all tiles
  std::vector<std::uint32_t> base_;    // tiles + 1, into vertices_
  std::vector<std::uint32_t> same_;    // one a vertex: the one that stands for it
  std::vector<std::uint32_t> begin_;   // charts + 1, into triangles_
  std::vector<Triangle> triangles_;
  // Of the chart at hand:
  std::vector<std::uint32_t> local_, scratch_, leaving_begin_, leaving_;
  std::vector<std::uint32_t> twin_;  // one a side: the inner side opposite
  std::vector<std::uint32_t> rim_;   // one a vertex: rim side that leaves it
};

}  // namespace

std::vector<ChartMesh> assemble_charts(const ChartGraph& graph,
                                       std::span<const std::uint64_t> nodes, std::uint32_t first,
                                       std::uint32_t last, std::span<const PieceView> pieces,
                                       bool has_colours) {
  return Assembler(graph, nodes, has_colours).run(first, last, pieces);
}

}  // namespace rattan::layout
