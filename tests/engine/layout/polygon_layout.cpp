// SPDX-License-Identifier: MIT
#include "tests/engine/layout/polygon_layout.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <map>
#include <numbers>
#include <utility>

namespace rattan::testing {
namespace {

void add_face(PolygonMesh& mesh, std::initializer_list<std::uint32_t> face) {
  mesh.add_face(std::vector<std::uint32_t>(face));
}

/// Builds one chart after another; vertices are found again by what they are.
class Builder {
 public:
  Builder(const PolygonMesh& mesh, const PolygonLayoutOptions& options, PolygonLayout& out)
      : mesh_(mesh), options_(options), out_(out), units_(out.graph.units) {
    out_.positions = mesh.positions;
  }

  void add(std::uint32_t chart) {
    FlatChart flat;
    flat.chart = chart;
    const auto n = static_cast<std::uint32_t>(mesh_.degree(chart));
    if (n == 4) {
      flat.kind = ChartKind::kUnfolded;
      add_part(flat, 0, units_);
    } else {
      flat.kind = ChartKind::kSplit;
      for (std::uint32_t corner = 0; corner < n; ++corner) {
        add_part(flat, corner, 1);
      }
    }
    out_.charts.push_back(std::move(flat));
  }

 private:
  // A layout vertex by its key: strand and place on it, or chart, part and place in it.
  using Key = std::array<std::uint32_t, 4>;

  std::uint32_t steps() const { return options_.cells * units_; }  // along a chart side

  /// The place of step i of a chart side in [0, units], along the strand's own direction.
  double warped(std::uint32_t i) const {
    const double x = static_cast<double>(i) / static_cast<double>(steps());
    const double y = x + options_.warp * std::sin(4.0 * std::numbers::pi * x) / 4.0;
    // Middles stay where they are.
    return 2 * i == steps() ? 0.5 * units_ : y * units_;
  }

  Vec3d corner(std::uint32_t chart, std::uint32_t k) const {
    const auto face = mesh_.face(chart);
    return mesh_.positions[face[k % face.size()]];
  }
  Vec3d centre(std::uint32_t chart) const {
    Vec3d sum = Vec3d::Zero();
    for (const std::uint32_t v : mesh_.face(chart)) {
      sum += mesh_.positions[v];
    }
    return sum / static_cast<double>(mesh_.degree(chart));
  }

  std::uint64_t made(const Key& key, const Vec3d& position) {
    const auto [it, fresh] = number_.emplace(key, out_.positions.size());
    if (fresh) {
      out_.positions.push_back(position);
    }
    return it->second;
  }

  struct Point {
    std::uint64_t number = 0;
    double along = 0.0;  // in units, along the chart's side
  };

  /// Step i of side k of a chart, counter-clockwise.
  Point on_side(std::uint32_t chart, std::uint32_t k, std::uint32_t i) {
    const std::uint32_t dart = out_.graph.ring(chart)[k];
    const bool back = (dart & 1U) != 0;
    const std::uint32_t j = back ? steps() - i : i;
    const double s = warped(j);
    const ChartStrand& strand = out_.graph.strands[dart >> 1];
    Point point;
    point.along = back ? static_cast<double>(units_) - s : s;
    if (j == 0 || j == steps()) {
      point.number = strand.node[j == 0 ? 0 : 1];
    } else {
      const Vec3d a = mesh_.positions[strand.node[0]];
      const Vec3d b = mesh_.positions[strand.node[1]];
      point.number = made({1, dart >> 1, j, 0}, a + (b - a) * (s / units_));
    }
    return point;
  }

  /// Step i from the middle of side k to the centre.
  Point on_spoke(std::uint32_t chart, std::uint32_t k, std::uint32_t i) {
    if (i == 0) {
      return {on_side(chart, k, options_.cells).number, 0.0};
    }
    const double s = static_cast<double>(i) / options_.cells;
    const Vec3d middle = 0.5 * (corner(chart, k) + corner(chart, k + 1));
    const Key key = i == options_.cells ? Key{3, chart, 0, 0} : Key{2, chart, k, i};
    return {made(key, middle + (centre(chart) - middle) * s), s};
  }

  /// Step i of side k of a part [0, length]^2.
  Point on_part(std::uint32_t chart, std::uint32_t part, std::uint32_t k, std::uint32_t i,
                std::uint32_t length) {
    const auto n = static_cast<std::uint32_t>(mesh_.degree(chart));
    if (n == 4) {
      return on_side(chart, k, i);
    }
    const std::uint32_t before = (part + n - 1) % n;
    switch (k) {
      case 0:
        return on_side(chart, part, i);
      case 1:
        return on_spoke(chart, part, i);
      case 2: {
        const Point p = on_spoke(chart, before, options_.cells - i);
        return {p.number, length - p.along};
      }
      default: {
        const Point p = on_side(chart, before, options_.cells + i);
        return {p.number, p.along - length};
      }
    }
  }

  void add_part(FlatChart& flat, std::uint32_t part, std::uint32_t length) {
    const std::uint32_t m = options_.cells * length;
    const std::uint32_t chart = flat.chart;
    std::array<std::vector<Point>, 4> side;
    for (std::uint32_t k = 0; k < 4; ++k) {
      for (std::uint32_t i = 0; i <= m; ++i) {
        side[k].push_back(on_part(chart, part, k, i, length));
      }
    }
    const auto at = [&](std::uint32_t k, std::uint32_t i) {
      return out_.positions[side[k][i].number];
    };
    const auto first = static_cast<std::uint32_t>(flat.uv.size());
    for (std::uint32_t j = 0; j <= m; ++j) {
      for (std::uint32_t i = 0; i <= m; ++i) {
        const double x = static_cast<double>(i) / m;
        const double y = static_cast<double>(j) / m;
        const double l = length;
        std::uint64_t number = 0;
        // Coordinates along opposite sides, blended.
        Vec2d uv((1 - y) * side[0][i].along + y * (l - side[2][m - i].along),
                 (1 - x) * (l - side[3][m - j].along) + x * side[1][j].along);
        if (j == 0) {
          number = side[0][i].number;
          uv = {side[0][i].along, 0.0};
        } else if (i == m) {
          number = side[1][j].number;
          uv = {l, side[1][j].along};
        } else if (j == m) {
          number = side[2][m - i].number;
          uv = {l - side[2][m - i].along, l};
        } else if (i == 0) {
          number = side[3][m - j].number;
          uv = {0.0, l - side[3][m - j].along};
        } else {
          const Vec3d p = (1 - x) * (1 - y) * at(0, 0) + x * (1 - y) * at(1, 0) + x * y * at(2, 0) +
                          (1 - x) * y * at(3, 0);
          number = made({4, chart, part, j * (m + 1) + i}, p);
        }
        flat.uv.push_back(uv);
        flat.uv_vertex.push_back(static_cast<std::uint32_t>(flat.number.size()));
        flat.number.push_back(number);
        flat.position.push_back(out_.positions[number]);
      }
    }
    const std::uint32_t w = m + 1;
    for (std::uint32_t j = 0; j < m; ++j) {
      for (std::uint32_t i = 0; i < m; ++i) {
        const std::uint32_t a = first + j * w + i;
        flat.triangle.push_back({a, a + 1, a + w + 1});
        flat.triangle.push_back({a, a + w + 1, a + w});
      }
    }
    flat.part_begin.push_back(static_cast<std::uint32_t>(flat.triangle.size()));
    flat.part_uv_begin.push_back(static_cast<std::uint32_t>(flat.uv.size()));
  }

  const PolygonMesh& mesh_;
  const PolygonLayoutOptions& options_;
  PolygonLayout& out_;
  const std::uint32_t units_;
  std::map<Key, std::uint64_t> number_;
};

}  // namespace

PolygonMesh polygon_cube() {
  return polygon_prism(4);
}

PolygonMesh polygon_prism(std::uint32_t n) {
  PolygonMesh mesh;
  std::vector<std::uint32_t> top;
  std::vector<std::uint32_t> bottom;
  for (std::uint32_t i = 0; i < n; ++i) {
    const double u = 2 * std::numbers::pi * i / n;
    mesh.positions.emplace_back(std::cos(u), std::sin(u), 0.0);
    mesh.positions.emplace_back(std::cos(u), std::sin(u), 1.0);
    top.push_back(2 * i + 1);
    bottom.push_back(2 * (n - 1 - i));
    const std::uint32_t j = (i + 1) % n;
    add_face(mesh, {2 * i, 2 * j, 2 * j + 1, 2 * i + 1});
  }
  mesh.add_face(top);
  mesh.add_face(bottom);
  return mesh;
}

PolygonMesh polygon_torus(std::uint32_t n, std::uint32_t m, std::uint32_t triangle_every) {
  PolygonMesh mesh;
  const double turn = 2 * std::numbers::pi;
  for (std::uint32_t j = 0; j < m; ++j) {
    for (std::uint32_t i = 0; i < n; ++i) {
      const double u = turn * i / n;
      const double v = turn * j / m;
      mesh.positions.emplace_back((3 + std::cos(v)) * std::cos(u), (3 + std::cos(v)) * std::sin(u),
                                  std::sin(v));
    }
  }
  for (std::uint32_t j = 0; j < m; ++j) {
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t a = j * n + i;
      const std::uint32_t b = j * n + (i + 1) % n;
      const std::uint32_t c = (j + 1) % m * n + (i + 1) % n;
      const std::uint32_t d = (j + 1) % m * n + i;
      if (triangle_every != 0 && a % triangle_every == 0) {
        add_face(mesh, {a, b, c});
        add_face(mesh, {a, c, d});
      } else {
        add_face(mesh, {a, b, c, d});
      }
    }
  }
  return mesh;
}

PolygonMesh polygon_grid(std::uint32_t n, std::uint32_t m, bool hole) {
  PolygonMesh mesh;
  std::map<std::uint32_t, std::uint32_t> number;
  const auto vertex = [&](std::uint32_t i, std::uint32_t j) {
    const auto [it, fresh] =
        number.emplace(j * (n + 1) + i, static_cast<std::uint32_t>(mesh.positions.size()));
    if (fresh) {
      mesh.positions.emplace_back(i * 0.1, j * 0.1, 0.05 * std::sin(0.7 * i) * std::cos(0.4 * j));
    }
    return it->second;
  };
  for (std::uint32_t j = 0; j < m; ++j) {
    for (std::uint32_t i = 0; i < n; ++i) {
      if (!hole || i < n / 3 || i >= 2 * n / 3 || j < m / 3 || j >= 2 * m / 3) {
        add_face(mesh, {vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)});
      }
    }
  }
  return mesh;
}

std::vector<NamedPolygons> polygon_meshes() {
  PolygonMesh tetrahedron;
  tetrahedron.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (const auto& face : {std::array{0U, 2U, 1U}, std::array{0U, 1U, 3U}, std::array{1U, 2U, 3U},
                           std::array{2U, 0U, 3U}}) {
    tetrahedron.add_face(face);
  }
  PolygonMesh two = polygon_prism(5);
  const PolygonMesh other = polygon_torus(4, 3);
  for (std::size_t f = 0; f < other.face_count(); ++f) {
    std::vector<std::uint32_t> face(other.face(f).begin(), other.face(f).end());
    for (std::uint32_t& v : face) {
      v += 10;
    }
    two.add_face(face);
  }
  two.positions.insert(two.positions.end(), other.positions.begin(), other.positions.end());
  return {{"cube", polygon_cube()},
          {"tetrahedron", tetrahedron},
          {"pentagons", polygon_prism(5)},
          {"nonagons", polygon_prism(9)},
          {"grid", polygon_grid(5, 4)},
          {"hole", polygon_grid(6, 6, true)},
          {"torus", polygon_torus(9, 7)},
          {"tiny_torus", polygon_torus(3, 3)},
          {"mixed_torus", polygon_torus(6, 5, 4)},
          {"components", two}};
}

ChartGraph chart_graph_of(const PolygonMesh& mesh) {
  ChartGraph graph;
  graph.node_position = mesh.positions;
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    graph.node_vertex.push_back(v);
  }
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> open;  // side to its strand
  for (std::uint32_t f = 0; f < mesh.face_count(); ++f) {
    const auto face = mesh.face(f);
    graph.units = face.size() == 4 ? graph.units : 2;
    for (std::size_t k = 0; k < face.size(); ++k) {
      const std::uint32_t a = face[k];
      const std::uint32_t b = face[(k + 1) % face.size()];
      const auto it = open.find({b, a});
      if (it != open.end()) {
        graph.strands[it->second].chart[1] = f;
        graph.ring_darts.push_back(2 * it->second + 1);
        open.erase(it);
      } else {
        const auto s = static_cast<std::uint32_t>(graph.strands.size());
        ChartStrand strand;
        strand.node = {a, b};
        strand.chart[0] = f;
        graph.strands.push_back(strand);
        graph.ring_darts.push_back(2 * s);
        open[{a, b}] = s;
      }
    }
    graph.ring_begin.push_back(static_cast<std::uint32_t>(graph.ring_darts.size()));
    graph.chart_singular.push_back(0);
  }
  return graph;
}

PolygonLayout::PolygonLayout(const PolygonMesh& mesh, const PolygonLayoutOptions& options)
    : graph(chart_graph_of(mesh)), options_(options) {
  Builder builder(mesh, options, *this);
  for (std::uint32_t chart = 0; chart < mesh.face_count(); ++chart) {
    builder.add(chart);
  }
  if (options.colours) {
    for (std::size_t v = 0; v < positions.size(); ++v) {
      colours.push_back({static_cast<std::uint8_t>(7 * v), static_cast<std::uint8_t>(31 * v),
                         static_cast<std::uint8_t>(v / 3), 255});
    }
  }
}

LayoutSize PolygonLayout::size() const {
  LayoutSize out;
  out.vertices = positions.size();
  out.charts = static_cast<std::uint32_t>(charts.size());
  out.units = graph.units;
  out.has_colours = options_.colours;
  for (const FlatChart& chart : charts) {
    out.texture_vertices += chart.uv.size();
    out.triangles += chart.triangle.size();
    out.parts += static_cast<std::uint32_t>(chart.part_begin.size() - 1);
  }
  return out;
}

void PolygonLayout::for_each_vertices(const std::function<void(const LayoutVertices&)>& f) {
  for (std::size_t first = 0; first < positions.size(); first += options_.vertices_at_once) {
    const std::size_t count =
        std::min<std::size_t>(options_.vertices_at_once, positions.size() - first);
    LayoutVertices block;
    block.first = first;
    block.position = {positions.data() + first, count};
    if (!colours.empty()) {
      block.colour = {colours.data() + first, count};
    }
    f(block);
  }
}

void PolygonLayout::for_each_chart(const std::function<void(const LayoutChart&)>& f) {
  LayoutChart out;
  for (const FlatChart& chart : charts) {
    std::vector<std::uint64_t> vertex;
    std::vector<Vec3d> position;
    std::vector<Rgba> colour;
    for (const std::uint32_t v : chart.uv_vertex) {
      vertex.push_back(chart.number[v]);
      position.push_back(positions[chart.number[v]]);
      if (!colours.empty()) {
        colour.push_back(colours[chart.number[v]]);
      }
    }
    out.chart = chart.chart;
    out.kind = chart.kind;
    out.vertex = vertex;
    out.position = position;
    out.colour = colour;
    out.uv = chart.uv;
    out.triangle = chart.triangle;
    out.part_begin = chart.part_begin;
    out.part_uv_begin = chart.part_uv_begin;
    f(out);
    out.first_part += static_cast<std::uint32_t>(chart.part_begin.size() - 1);
    out.first_texture_vertex += chart.uv.size();
  }
}

}  // namespace rattan::testing
