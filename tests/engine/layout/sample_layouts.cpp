// SPDX-License-Identifier: MIT
#include "tests/engine/layout/sample_layouts.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "engine/core/exact_math.h"
#include "engine/layout/disjoint_sets.h"
#include "engine/layout/disk_sides.h"
#include "engine/layout/flat_disk.h"

namespace rattan::testing {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;

class Builder {
 public:
  explicit Builder(const LayoutRecipe& recipe) : recipe_(recipe), mesh_(recipe.mesh) {
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      for (std::uint32_t k = 0; k < 3; ++k) {
        side_of_[{mesh_.triangles[t][k], mesh_.triangles[t][(k + 1) % 3]}] = 3 * t + k;
      }
    }
    std::set<Edge> extra;
    for (const auto& [a, b] : recipe.lines) {
      extra.insert(std::minmax(a, b));
    }
    for (const auto& [edge, side] : side_of_) {
      const std::uint32_t right = chart_of(edge.second, edge.first);
      if (right != recipe.chart[side / 3] || extra.count(std::minmax(edge.first, edge.second))) {
        line_.insert(std::minmax(edge.first, edge.second));
      }
    }
    for (const Edge& e : line_) {
      lines_at_[e.first].push_back(e.second);
      lines_at_[e.second].push_back(e.first);
    }
    is_node_.assign(mesh_.positions.size(), 0);
    for (const auto& [v, ends] : lines_at_) {
      is_node_[v] = ends.size() != 2 ? 1 : 0;
    }
    for (const std::uint32_t v : recipe.nodes) {
      is_node_[v] = 1;
    }
  }

  SampleLayout run() {
    add_strands();
    std::uint32_t charts = 0;
    for (const std::uint32_t c : recipe_.chart) {
      charts = std::max(charts, c + 1);
    }
    for (std::uint32_t c = 0; c < charts; ++c) {
      add_chart(c);
    }
    ChartGraph& g = result_.graph;
    g.chart_singular.assign(charts, 0);
    g.first_division = mesh_.positions.size();
    for (std::uint32_t c = 0; c < charts; ++c) {
      g.units = g.sides(c) == 4 ? g.units : 2;
    }
    g.division_begin.assign(1, 0);
    for (const ChartStrand& s : g.strands) {
      g.division_begin.push_back(g.division_begin.back() + s.parts * g.units -
                                 (s.closed() ? 0 : 1));
    }
    return std::move(result_);
  }

 private:
  std::uint32_t chart_of(std::uint32_t a, std::uint32_t b) const {
    const auto it = side_of_.find({a, b});
    return it == side_of_.end() ? kNoChart : recipe_.chart[it->second / 3];
  }

  void add_strand(std::vector<std::uint32_t> chain) {
    if (chart_of(chain[0], chain[1]) == kNoChart) {
      std::reverse(chain.begin(), chain.end());
    }
    const auto s = static_cast<std::uint32_t>(result_.graph.strands.size());
    ChartStrand strand;
    strand.chart = {chart_of(chain[0], chain[1]), chart_of(chain[1], chain[0])};
    strand.along_edges = true;
    const bool open = is_node_[chain.front()] != 0;
    strand.parts = open ? recipe_.parts : recipe_.closed_parts;
    if (open) {
      strand.node = {node(chain.front()), node(chain.back())};
    }
    for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
      dart_[{chain[i], chain[i + 1]}] = 2 * s;
      dart_[{chain[i + 1], chain[i]}] = 2 * s + 1;
    }
    edges_.push_back(chain.size() - 1);
    result_.graph.strands.push_back(strand);
  }

  std::uint32_t node(std::uint32_t v) {
    const auto [it, is_new] =
        node_.try_emplace(v, static_cast<std::uint32_t>(result_.graph.node_vertex.size()));
    if (is_new) {
      result_.graph.node_vertex.push_back(v);
      result_.graph.node_position.push_back(mesh_.positions[v]);
    }
    return it->second;
  }

  void add_strands() {
    const auto walk = [&](std::uint32_t a, std::uint32_t b) {
      std::vector<std::uint32_t> chain{a, b};
      while (is_node_[chain.back()] == 0 && chain.back() != a) {
        const auto& ends = lines_at_[chain.back()];
        chain.push_back(ends[0] == chain[chain.size() - 2] ? ends[1] : ends[0]);
      }
      add_strand(chain);
    };
    for (const bool open : {true, false}) {
      for (const auto& [v, ends] : lines_at_) {
        for (const std::uint32_t to : ends) {
          if ((is_node_[v] != 0) == open && dart_.count({v, to}) == 0) {
            walk(v, to);
          }
        }
      }
    }
  }

  void add_chart(std::uint32_t c) {
    ChartMesh chart;
    chart.chart = c;
    // Corners of triangles on the same side of all lines are one vertex.
    layout::DisjointSets corners(3 * mesh_.triangles.size());
    for (const auto& [edge, side] : side_of_) {
      const auto it = side_of_.find({edge.second, edge.first});
      if (it != side_of_.end() && line_.count(std::minmax(edge.first, edge.second)) == 0) {
        corners.unite(side, layout::next_side(it->second));
        corners.unite(layout::next_side(side), it->second);
      }
    }
    std::map<std::uint32_t, std::uint32_t> vertex;
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (recipe_.chart[t] != c) {
        continue;
      }
      std::array<std::uint32_t, 3> corner{};
      std::array<std::uint32_t, 3> dart{};
      std::array<double, 3> step{};
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t v = mesh_.triangles[t][k];
        const auto [it, is_new] = vertex.try_emplace(
            corners.find(3 * t + k), static_cast<std::uint32_t>(chart.number.size()));
        corner[k] = it->second;
        if (is_new) {
          chart.number.push_back(v);
          chart.position.push_back(mesh_.positions[v]);
          chart.is_node.push_back(is_node_[v]);
          if (recipe_.colours) {
            chart.colour.push_back({static_cast<std::uint8_t>(v * 7), static_cast<std::uint8_t>(v),
                                    static_cast<std::uint8_t>(v / 3), 255});
          }
        }
        const auto found = dart_.find({v, mesh_.triangles[t][(k + 1) % 3]});
        dart[k] = found == dart_.end() ? kInsideChart : found->second;
        step[k] = recipe_.even_steps && dart[k] != kInsideChart
                      ? 1.0 / static_cast<double>(edges_[dart[k] >> 1])
                      : -1.0;
      }
      chart.triangle.push_back(corner);
      chart.dart.push_back(dart);
      chart.step.push_back(step);
    }
    add_ring(chart);
    result_.charts.push_back(std::move(chart));
  }

  void add_ring(const ChartMesh& chart) {
    const std::vector<std::uint32_t> rim =
        layout::match_sides(chart.triangle, chart.number.size()).rim;
    std::vector<std::uint32_t> ring;
    for (const std::uint32_t side : rim) {
      const std::uint32_t v = chart.triangle[side / 3][side % 3];
      const std::uint32_t dart = chart.dart[side / 3][side % 3];
      if (chart.is_node[v] != 0) {
        ring.push_back(dart);
      }
    }
    if (ring.empty()) {
      ring.push_back(chart.dart[rim[0] / 3][rim[0] % 3]);
    }
    ChartGraph& g = result_.graph;
    g.ring_darts.insert(g.ring_darts.end(), ring.begin(), ring.end());
    g.ring_begin.push_back(static_cast<std::uint32_t>(g.ring_darts.size()));
  }

  const LayoutRecipe& recipe_;
  const IndexedMesh& mesh_;
  std::map<Edge, std::uint32_t> side_of_;
  std::set<Edge> line_;
  std::map<std::uint32_t, std::vector<std::uint32_t>> lines_at_;
  std::vector<std::uint8_t> is_node_;
  std::map<std::uint32_t, std::uint32_t> node_;
  std::map<Edge, std::uint32_t> dart_;
  std::vector<std::size_t> edges_;
  SampleLayout result_;
};

}  // namespace

SampleLayout make_layout(const LayoutRecipe& recipe) {
  return Builder(recipe).run();
}

SampleLayout plane_layout(std::uint32_t nx, std::uint32_t ny, std::uint32_t n, double jitter,
                          std::uint64_t seed) {
  LayoutRecipe recipe;
  recipe.mesh = grid(nx * n, ny * n, 1.0 / n);
  const auto square_of = [&](std::uint32_t t) {
    Vec3d middle = Vec3d::Zero();
    for (const std::uint32_t v : recipe.mesh.triangles[t]) {
      middle += recipe.mesh.positions[v] / 3;
    }
    return static_cast<std::uint32_t>(std::floor(middle.y())) * nx +
           static_cast<std::uint32_t>(std::floor(middle.x()));
  };
  for (std::uint32_t t = 0; t < recipe.mesh.triangles.size(); ++t) {
    recipe.chart.push_back(square_of(t));
  }
  Random random(seed);
  for (Vec3d& p : recipe.mesh.positions) {
    const Vec3d inside = p - Vec3d(std::round(p.x()), std::round(p.y()), 0);
    if (std::abs(inside.x()) > 1e-9 && std::abs(inside.y()) > 1e-9) {
      p += jitter / n * Vec3d(2 * random.next() - 1, 2 * random.next() - 1, 0);
    }
  }
  for (std::uint32_t y = 0; y <= ny; ++y) {
    for (std::uint32_t x = 0; x <= nx; ++x) {
      for (std::uint32_t v = 0; v < recipe.mesh.positions.size(); ++v) {
        if ((recipe.mesh.positions[v] - Vec3d(x, y, 0)).norm() < 1e-9) {
          recipe.nodes.push_back(v);
        }
      }
    }
  }
  recipe.even_steps = true;
  SampleLayout layout = make_layout(recipe);
  for (ChartMesh& chart : layout.charts) {
    const auto corner = [&](std::size_t i) {
      const std::uint32_t dart = layout.graph.ring(chart.chart)[i];
      return layout.graph.node_position[layout.graph.strands[dart >> 1].node[dart & 1U]];
    };
    for (const Vec3d& p : chart.position) {
      const Vec3d from = p - corner(0);
      chart.unfolded.emplace_back(from.dot(corner(1) - corner(0)), from.dot(corner(3) - corner(0)));
    }
  }
  return layout;
}

LayoutRecipe torus_layout(std::uint32_t nu, std::uint32_t nv, std::uint32_t n) {
  LayoutRecipe recipe;
  recipe.mesh = torus(nu * n, nv * n);
  // Two triangles a quad, quads in rows.
  for (std::uint32_t t = 0; t < recipe.mesh.triangles.size(); ++t) {
    const std::uint32_t quad = t / 2;
    recipe.chart.push_back(quad / (nv * n) / n * nv + quad % (nv * n) / n);
  }
  return recipe;
}

LayoutRecipe octants(int levels) {
  LayoutRecipe recipe;
  recipe.mesh = sphere(levels);
  for (const auto& t : recipe.mesh.triangles) {
    const Vec3d sum =
        recipe.mesh.positions[t[0]] + recipe.mesh.positions[t[1]] + recipe.mesh.positions[t[2]];
    recipe.chart.push_back((sum.x() > 0 ? 1U : 0U) + (sum.y() > 0 ? 2U : 0U) +
                           (sum.z() > 0 ? 4U : 0U));
  }
  return recipe;
}

LayoutRecipe half_spheres(int levels, std::uint32_t parts) {
  LayoutRecipe recipe = octants(levels);
  for (std::uint32_t& c : recipe.chart) {
    c /= 4;
  }
  recipe.closed_parts = parts;
  return recipe;
}

LayoutRecipe cut_torus(std::uint32_t nu, std::uint32_t nv) {
  LayoutRecipe recipe;
  recipe.mesh = torus(nu, nv);
  recipe.chart.assign(recipe.mesh.triangles.size(), 0);
  for (std::uint32_t i = 0; i < nu; ++i) {
    recipe.lines.push_back({i * nv, (i + 1) % nu * nv});
  }
  for (std::uint32_t j = 0; j < nv; ++j) {
    recipe.lines.push_back({j, (j + 1) % nv});
  }
  return recipe;
}

LayoutRecipe disk_layout(std::uint32_t rings, std::uint32_t segments, std::uint32_t sides,
                         const std::function<Vec3d(double, double)>& place) {
  LayoutRecipe recipe;
  recipe.mesh.name = "disk";
  const auto put = [&](double radius, double angle) {
    const auto [sine, cosine] = exact::sincos(angle);
    recipe.mesh.positions.push_back(place ? place(radius, angle)
                                          : Vec3d(radius * cosine, radius * sine, 0));
  };
  put(0, 0);
  for (std::uint32_t r = 1; r <= rings; ++r) {
    for (std::uint32_t s = 0; s < segments; ++s) {
      put(static_cast<double>(r) / rings, 2 * exact::kPi * s / segments);
    }
  }
  const auto at = [&](std::uint32_t r, std::uint32_t s) {
    return r == 0 ? 0 : 1 + (r - 1) * segments + s % segments;
  };
  for (std::uint32_t r = 0; r < rings; ++r) {
    for (std::uint32_t s = 0; s < segments; ++s) {
      recipe.mesh.triangles.push_back({at(r, s), at(r + 1, s), at(r + 1, s + 1)});
      if (r > 0) {
        recipe.mesh.triangles.push_back({at(r, s), at(r + 1, s + 1), at(r, s + 1)});
      }
    }
  }
  for (std::uint32_t i = 0; i < sides; ++i) {
    recipe.nodes.push_back(at(rings, i * segments / sides));
  }
  recipe.chart.assign(recipe.mesh.triangles.size(), 0);
  return recipe;
}

LayoutRecipe ragged_layout(std::uint64_t seed, std::uint32_t triangles, std::uint32_t sides) {
  const IndexedMesh whole = grid(24, 24);
  Random random(seed);
  const auto below = [&](std::size_t n) {
    return static_cast<std::uint32_t>(random.next() * static_cast<double>(n));
  };
  std::map<Edge, std::uint32_t> side_of;
  for (std::uint32_t t = 0; t < whole.triangles.size(); ++t) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      side_of[{whole.triangles[t][k], whole.triangles[t][(k + 1) % 3]}] = 3 * t + k;
    }
  }
  std::set<std::uint32_t> taken{static_cast<std::uint32_t>(whole.triangles.size() / 2)};
  const auto uses = [&](std::uint32_t v) {
    return std::any_of(taken.begin(), taken.end(), [&](std::uint32_t t) {
      const auto& c = whole.triangles[t];
      return c[0] == v || c[1] == v || c[2] == v;
    });
  };
  while (taken.size() < triangles) {
    const std::uint32_t t = below(whole.triangles.size());
    if (taken.count(t) != 0) {
      continue;
    }
    int shared = 0;
    bool apex_free = false;
    for (std::uint32_t k = 0; k < 3; ++k) {
      const auto& c = whole.triangles[t];
      const auto it = side_of.find({c[(k + 1) % 3], c[k]});
      if (it != side_of.end() && taken.count(it->second / 3) != 0) {
        ++shared;
        apex_free = !uses(c[(k + 2) % 3]);
      }
    }
    if (shared == 2 || (shared == 1 && apex_free)) {
      taken.insert(t);
    }
  }
  LayoutRecipe recipe;
  recipe.mesh = without(whole, [&](std::uint32_t t) { return taken.count(t) == 0; });
  const IndexedMesh& kept = recipe.mesh;
  const layout::DiskSides matched = layout::match_sides(kept.triangles, kept.positions.size());
  std::set<std::uint32_t> nodes;
  while (nodes.size() < std::min<std::size_t>(sides, matched.rim.size())) {
    const std::uint32_t side = matched.rim[below(matched.rim.size())];
    nodes.insert(kept.triangles[side / 3][side % 3]);
  }
  recipe.nodes.assign(nodes.begin(), nodes.end());
  recipe.chart.assign(kept.triangles.size(), 0);
  return recipe;
}

void disturb(IndexedMesh& mesh, double noise, double needles, std::uint64_t seed) {
  Random random(seed);
  for (Vec3d& p : mesh.positions) {
    p += noise * Vec3d(2 * random.next() - 1, 2 * random.next() - 1, 2 * random.next() - 1);
  }
  for (const auto& t : mesh.triangles) {
    if (random.next() < needles) {
      const double share = random.next() < 0.3 ? 0.0 : random.next();
      mesh.positions[t[0]] = (1 - share) * mesh.positions[t[1]] + share * mesh.positions[t[2]];
    }
  }
}

void expect_flat(const FlatChart& chart, const ChartMesh& mesh, const ChartGraph& graph) {
  const std::uint32_t sides = graph.sides(mesh.chart);
  const std::size_t parts = sides == 4 ? 1 : sides;
  EXPECT_EQ(chart.chart, mesh.chart);
  ASSERT_EQ(chart.kind == ChartKind::kSplit, sides != 4);
  ASSERT_EQ(chart.part_begin.size(), parts + 1);
  ASSERT_EQ(chart.part_uv_begin.size(), parts + 1);
  ASSERT_EQ(chart.part_begin.back(), chart.triangle.size());
  ASSERT_EQ(chart.part_uv_begin.back(), chart.uv.size());
  ASSERT_EQ(chart.uv_vertex.size(), chart.uv.size());
  ASSERT_EQ(chart.number.size(), chart.position.size());
  ASSERT_TRUE(chart.colour.size() == (mesh.colour.empty() ? 0 : chart.number.size()));
  std::uint32_t rim = 0;
  for (const auto& t : mesh.dart) {
    rim += static_cast<std::uint32_t>(3 - std::count(t.begin(), t.end(), kInsideChart));
  }
  // Sides with hundreds of vertices, and the bundles of spokes from dozens of sides, are too
  // crowded for the floor.
  EXPECT_TRUE(chart.thin == 0 || rim > 100 * sides || sides > 24)
      << chart.thin << " thin, " << mesh.triangle.size() << " triangles, " << rim << " on the rim, "
      << sides << " sides";
  for (std::size_t v = 0; v < mesh.number.size(); ++v) {
    ASSERT_EQ(chart.number[v], mesh.number[v]);
    ASSERT_EQ(chart.position[v], mesh.position[v]);
  }
  std::vector<std::uint8_t> used(chart.number.size(), 0);
  double surface = 0;
  for (std::size_t p = 0; p < parts; ++p) {
    const double size = sides == 4 ? graph.units : 1;
    const std::uint32_t first = chart.part_uv_begin[p];
    std::vector<std::array<std::uint32_t, 3>> triangle(
        chart.triangle.begin() + chart.part_begin[p],
        chart.triangle.begin() + chart.part_begin[p + 1]);
    double area = 0;
    for (auto& t : triangle) {
      std::array<Vec2d, 3> c;
      for (int k = 0; k < 3; ++k) {
        c[k] = chart.uv[t[k]];
        used[chart.uv_vertex[t[k]]] = 1;
      }
      const std::array<Vec3d, 3> q{chart.position[chart.uv_vertex[t[0]]],
                                   chart.position[chart.uv_vertex[t[1]]],
                                   chart.position[chart.uv_vertex[t[2]]]};
      surface += 0.5 * (q[1] - q[0]).cross(q[2] - q[0]).norm();
      area += 0.5 * layout::doubled_area(c[0], c[1], c[2]);
      ASSERT_GT(layout::doubled_area(c[0], c[1], c[2]), 0);
      if (chart.thin != 0) {
        continue;
      }
      ASSERT_GE(layout::thickness(c[0], c[1], c[2]), layout::kLeastThickness);
      for (const double grid : {1.0 / 65536, 1.0 / 16384}) {
        std::array<Vec2d, 3> r;
        for (int k = 0; k < 3; ++k) {
          r[k] = {std::floor(c[k].x() / grid + 0.5), std::floor(c[k].y() / grid + 0.5)};
        }
        ASSERT_GT(layout::doubled_area(r[0], r[1], r[2]), 0);
      }
    }
    for (auto& t : triangle) {
      for (std::uint32_t& v : t) {
        ASSERT_GE(v, first);
        v -= first;
      }
    }
    EXPECT_NEAR(area, size * size, 1e-9);
    // Triangles of positive area that fill the square once, within a rim that runs once around it.
    const layout::DiskSides matched =
        layout::match_sides(triangle, chart.part_uv_begin[p + 1] - first);
    double length = 0;
    for (const std::uint32_t side : matched.rim) {
      const Vec2d& a = chart.uv[first + triangle[side / 3][side % 3]];
      const Vec2d& b = chart.uv[first + triangle[side / 3][layout::next_side(side) % 3]];
      const bool along = (a.y() == 0 && b.y() == 0 && b.x() > a.x()) ||
                         (a.x() == size && b.x() == size && b.y() > a.y()) ||
                         (a.y() == size && b.y() == size && b.x() < a.x()) ||
                         (a.x() == 0 && b.x() == 0 && b.y() < a.y());
      ASSERT_TRUE(along);
      length += (b - a).norm();
    }
    EXPECT_NEAR(length, 4 * size, 1e-9);
  }
  EXPECT_EQ(std::count(used.begin(), used.end(), 0), 0);
  double before = 0;
  for (const auto& t : mesh.triangle) {
    before += 0.5 * (mesh.position[t[1]] - mesh.position[t[0]])
                        .cross(mesh.position[t[2]] - mesh.position[t[0]])
                        .norm();
  }
  EXPECT_NEAR(surface, before, 1e-9 * (1 + before));
}

}  // namespace rattan::testing
