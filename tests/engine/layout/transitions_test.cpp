// SPDX-License-Identifier: MIT
// Transition functions against what they must be: around every vertex they compose to the turn that
// its corners leave.

#include "engine/layout/transitions.h"

#include <array>
#include <map>
#include <set>
#include <tuple>

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "tests/engine/layout/polygon_layout.h"

namespace rattan {
namespace {

using Place = std::tuple<std::uint32_t, int, int>;  // part, side, unit

Place place(const UnitSide& u) {
  return {u.part, u.side, u.unit};
}

/// Every glued unit side, seen from its own part.
std::map<Place, Transition> by_place(const Transitions& all) {
  std::map<Place, Transition> out;
  for (const Transition& t : all.pairs) {
    EXPECT_TRUE(out.emplace(place(t.a), t).second);
    EXPECT_TRUE(out.emplace(place(t.b), t.inverse()).second);
  }
  return out;
}

int length_of(const Transitions& all, std::uint32_t part) {
  return all.parts[part].split ? 1 : static_cast<int>(all.units);
}

Vec2d start_of(const Transitions& all, const Place& place) {
  const auto [part, side, unit] = place;
  const double l = length_of(all, part);
  const std::array<Vec2d, 4> start{Vec2d(0, 0), Vec2d(l, 0), Vec2d(l, l), Vec2d(0, l)};
  const std::array<Vec2d, 4> along{Vec2d(1, 0), Vec2d(0, 1), Vec2d(-1, 0), Vec2d(0, -1)};
  const auto k = static_cast<std::size_t>(side);
  return start[k] + along[k] * unit;
}

Vec2d end_of(const Transitions& all, const Place& place) {
  const std::array<Vec2d, 4> along{Vec2d(1, 0), Vec2d(0, 1), Vec2d(-1, 0), Vec2d(0, -1)};
  return start_of(all, place) + along[static_cast<std::size_t>(std::get<1>(place))];
}

/// All unit sides are there, once; glued ones run against each other.
void expect_whole(const Transitions& all) {
  const std::map<Place, Transition> glued = by_place(all);
  std::set<Place> seen;
  for (const auto& [at, t] : glued) {
    seen.insert(at);
    EXPECT_EQ(t(start_of(all, at)), end_of(all, place(t.b)));
    EXPECT_EQ(t(end_of(all, at)), start_of(all, place(t.b)));
    const Vec2d p(0.25, 0.625);
    EXPECT_EQ(t.inverse()(t(p)), p);
    EXPECT_EQ(t(t.inverse()(p)), p);
    EXPECT_EQ(place(t.inverse().inverse().a), at);
  }
  for (const BoundarySide& b : all.boundary) {
    EXPECT_TRUE(seen.insert(place(b.side)).second);
  }
  std::size_t expected = 0;
  for (std::uint32_t part = 0; part < all.parts.size(); ++part) {
    for (int side = 0; side < 4; ++side) {
      for (int unit = 0; unit < length_of(all, part); ++unit) {
        ++expected;
        EXPECT_TRUE(seen.contains({part, side, unit}));
      }
    }
  }
  EXPECT_EQ(seen.size(), expected);
}

struct Loops {
  std::size_t regular = 0;
  std::size_t irregular = 0;
};

/// Walks around the start of every unit side, from part to part.
Loops expect_turns(const Transitions& all) {
  const std::map<Place, Transition> glued = by_place(all);
  Loops loops;
  std::set<Place> visited;
  for (const auto& entry : glued) {
    const Place first = entry.first;
    if (visited.contains(first)) {
      continue;
    }
    Place at = first;
    int quarters = 0;
    bool closed = true;
    // Where two points of the first part are, in the coordinates of the part the walk is in.
    const Vec2d vertex = start_of(all, first);
    Vec2d fixed = vertex;
    Vec2d other = vertex + Vec2d(0.5, 0.25);
    do {
      visited.insert(at);
      const auto [part, side, unit] = at;
      // The unit side that ends where this one starts.
      const Place before = unit > 0 ? Place{part, side, unit - 1}
                                    : Place{part, (side + 3) % 4, length_of(all, part) - 1};
      quarters += unit > 0 ? 2 : 1;
      const auto it = glued.find(before);
      if (it == glued.end()) {
        closed = false;
        break;
      }
      fixed = it->second(fixed);
      other = it->second(other);
      at = place(it->second.b);
      EXPECT_EQ(start_of(all, at), fixed);
    } while (at != first);
    if (!closed) {
      continue;
    }
    EXPECT_EQ(fixed, vertex);
    // The rest of the full turn.
    Vec2d expected(0.5, 0.25);
    for (int i = 0; i < ((4 - quarters) % 4 + 4) % 4; ++i) {
      expected = Vec2d(-expected[1], expected[0]);
    }
    EXPECT_EQ(other - fixed, expected) << quarters << " quarters";
    ++(quarters == 4 ? loops.regular : loops.irregular);
  }
  return loops;
}

TEST(Transitions, HoldOnEveryMesh) {
  for (const auto& [name, mesh] : testing::polygon_meshes()) {
    SCOPED_TRACE(name);
    const Transitions all = transitions_of(testing::chart_graph_of(mesh));
    expect_whole(all);
    expect_turns(all);
    std::size_t parts = 0;
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
      parts += mesh.degree(f) == 4 ? 1 : mesh.degree(f);
    }
    EXPECT_EQ(all.parts.size(), parts);
  }
}

TEST(Transitions, ComposeToTheIdentityAroundRegularVertices) {
  const Transitions quads = transitions_of(testing::chart_graph_of(testing::polygon_torus(9, 7)));
  EXPECT_EQ(quads.units, 1U);
  EXPECT_EQ(expect_turns(quads).regular, 63U);
  EXPECT_EQ(expect_turns(quads).irregular, 0U);
  const Transitions cube = transitions_of(testing::chart_graph_of(testing::polygon_cube()));
  EXPECT_EQ(expect_turns(cube).regular, 0U);
  EXPECT_EQ(expect_turns(cube).irregular, 8U);
  // Beside split charts all sides have a middle: the vertices of the base complex.
  const Transitions mixed =
      transitions_of(testing::chart_graph_of(testing::polygon_torus(9, 7, 5)));
  EXPECT_EQ(mixed.units, 2U);
  const Loops loops = expect_turns(mixed);
  EXPECT_GT(loops.regular, 100U);
  EXPECT_GE(loops.irregular, 26U);  // the centres of triangles at least
}

/// Points that were one in the layout are mapped onto each other.
TEST(Transitions, MapTextureVerticesOntoEachOther) {
  testing::PolygonLayoutOptions options;
  options.warp = 0.1;
  for (const auto& [name, mesh] : testing::polygon_meshes()) {
    SCOPED_TRACE(name);
    testing::PolygonLayout layout(mesh, options);
    const Transitions all = transitions_of(layout.graph);
    // Texture vertices on each unit side, by vertex.
    std::map<Place, std::map<std::uint64_t, Vec2d>> rim;
    layout.for_each_chart([&](const LayoutChart& chart) {
      for (std::uint32_t part = 0; part + 1 < chart.part_begin.size(); ++part) {
        const std::uint32_t number = chart.first_part + part;
        EXPECT_EQ(all.parts[number].chart, chart.chart);
        EXPECT_EQ(all.parts[number].corner, part);
        const double l = length_of(all, number);
        for (std::uint32_t v = chart.part_uv_begin[part]; v < chart.part_uv_begin[part + 1]; ++v) {
          const Vec2d uv = chart.uv[v];
          const std::array<double, 4> off{uv[1], l - uv[0], l - uv[1], uv[0]};
          const std::array<double, 4> along{uv[0], uv[1], l - uv[0], l - uv[1]};
          for (int side = 0; side < 4; ++side) {
            const auto k = static_cast<std::size_t>(side);
            for (int unit = 0; unit < l && off[k] == 0.0; ++unit) {
              if (along[k] >= unit && along[k] <= unit + 1) {
                rim[{number, side, unit}][chart.vertex[v]] = uv;
              }
            }
          }
        }
      }
    });
    for (const Transition& t : all.pairs) {
      const auto& a = rim[place(t.a)];
      const auto& b = rim[place(t.b)];
      ASSERT_EQ(a.size(), options.cells + 1);
      ASSERT_EQ(b.size(), options.cells + 1);
      for (const auto& [vertex, uv] : a) {
        ASSERT_TRUE(b.contains(vertex));
        EXPECT_LT((t(uv) - b.at(vertex)).cwiseAbs().maxCoeff(), 1e-12);
      }
    }
  }
}

TEST(Transitions, KnowClosedStrands) {
  // A sphere of two charts: one closed strand that stands for four sides of both.
  ChartGraph sphere;
  ChartStrand equator;
  equator.chart = {0, 1};
  equator.parts = 4;
  sphere.strands = {equator};
  sphere.ring_begin = {0, 1, 2};
  sphere.ring_darts = {0, 1};
  const Transitions two = transitions_of(sphere);
  ASSERT_EQ(two.pairs.size(), 4U);
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(two.pairs[static_cast<std::size_t>(i)].a.side, i);
    EXPECT_EQ(two.pairs[static_cast<std::size_t>(i)].b.side, 3 - i);
  }
  expect_whole(two);
  EXPECT_EQ(expect_turns(two).irregular, 4U);
  // Of three sides: both charts are split.
  sphere.strands[0].parts = 3;
  sphere.units = 2;
  const Transitions split = transitions_of(sphere);
  EXPECT_EQ(split.parts.size(), 6U);
  expect_whole(split);
  // Corners and middles of sides, centres.
  EXPECT_EQ(expect_turns(split).regular + expect_turns(split).irregular, 8U);
}

TEST(Transitions, KnowChartsThatMeetThemselves) {
  // A tube cut along a strand: side 1 of its one chart is side 3.
  ChartGraph tube;
  tube.node_position = {Vec3d(1, 0, 0), Vec3d(1, 0, 1)};
  ChartStrand low;
  low.node = {0, 0};
  low.chart[0] = 0;
  ChartStrand high = low;
  high.node = {1, 1};
  ChartStrand cut;
  cut.node = {0, 1};
  cut.chart = {0, 0};
  tube.strands = {low, high, cut};
  tube.ring_begin = {0, 4};
  tube.ring_darts = {0, 4, 2, 5};
  const Transitions all = transitions_of(tube);
  expect_whole(all);
  ASSERT_EQ(all.pairs.size(), 1U);
  EXPECT_EQ(all.boundary.size(), 2U);
  EXPECT_EQ(all.pairs[0].a, (UnitSide{0, 1, 0}));
  EXPECT_EQ(all.pairs[0].b, (UnitSide{0, 3, 0}));
  EXPECT_EQ(all.pairs[0].turn, 0);
  EXPECT_EQ(all.pairs[0](Vec2d(1, 0.25)), Vec2d(0, 0.25));
  tube.units = 2;
  expect_whole(transitions_of(tube));
}

TEST(Transitions, RefuseGraphsThatContradictThemselves) {
  ChartGraph graph = testing::chart_graph_of(testing::polygon_cube());
  graph.ring_darts[3] = graph.ring_darts[2];
  EXPECT_THROW(transitions_of(graph), InternalError);
  graph = testing::chart_graph_of(testing::polygon_prism(5));
  graph.units = 1;  // of a split chart
  EXPECT_THROW(transitions_of(graph), InternalError);
}

}  // namespace
}  // namespace rattan
