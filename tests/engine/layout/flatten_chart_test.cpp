// SPDX-License-Identifier: MIT
#include "engine/layout/flatten_chart.h"

#include <map>

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "engine/core/exact_math.h"
#include "engine/core/memory_store.h"
#include "engine/layout/chart_extraction.h"
#include "engine/layout/mean_value.h"
#include "engine/layout/square_map.h"
#include "engine/layout/strand_parameters.h"
#include "tests/engine/layout/sample_layouts.h"

namespace rattan {
namespace {

using layout::FlatDisk;
using layout::RimVertex;
using testing::expect_flat;
using testing::LayoutRecipe;
using testing::make_layout;
using testing::SampleLayout;

std::vector<FlatChart> flatten_all(const SampleLayout& sample) {
  std::vector<FlatChart> charts;
  for (const ChartMesh& c : sample.charts) {
    ChartMesh copy = c;
    charts.push_back(flatten_chart(std::move(copy), sample.graph));
    expect_flat(charts.back(), c, sample.graph);
    if (::testing::Test::HasFatalFailure()) {
      break;
    }
  }
  return charts;
}

/// What a vertex on a strand must be the same from both sides: parameter and place.
struct SeenPoint {
  double at = 0;
  Vec3d position;
  Rgba colour{};
};

/// Every chart has the strands' points with the same numbers, parameters, places and colours, and
/// the parameters are those of its texture vertices.
void expect_continuous(const SampleLayout& sample, const std::vector<FlatChart>& charts) {
  using Key = std::pair<std::uint32_t, std::uint64_t>;
  std::map<std::uint32_t, std::map<Key, SeenPoint>> seen;  // by dart
  for (const ChartMesh& c : sample.charts) {
    ChartMesh divided = c;
    const std::vector<RimVertex> rim = layout::divide_sides(divided, sample.graph);
    const FlatChart& flat = charts[c.chart];
    std::vector<std::vector<std::uint32_t>> uv_of(flat.number.size());
    for (std::uint32_t u = 0; u < flat.uv.size(); ++u) {
      uv_of[flat.uv_vertex[u]].push_back(u);
    }
    std::vector<std::uint32_t> dart_of_side;
    std::vector<std::uint32_t> part_of_side;
    for (const std::uint32_t dart : sample.graph.ring(c.chart)) {
      for (std::uint32_t p = 0; p < sample.graph.strands[dart >> 1].parts; ++p) {
        dart_of_side.push_back(dart);
        part_of_side.push_back(p);
      }
    }
    const auto sides = static_cast<std::uint32_t>(dart_of_side.size());
    ASSERT_EQ(sample.graph.sides(c.chart), sides);
    for (std::size_t i = 0; i < rim.size(); ++i) {
      const RimVertex& r = rim[i];
      ASSERT_LT(r.side, sides);
      const std::uint32_t dart = dart_of_side[r.side];
      const ChartStrand& strand = sample.graph.strands[dart >> 1];
      const double along = part_of_side[r.side] * sample.graph.units + r.along;
      const double at = (dart & 1U) == 0 ? along : strand.parts * sample.graph.units - along;
      const SeenPoint point{at, divided.position[r.vertex],
                            divided.colour.empty() ? Rgba{} : divided.colour[r.vertex]};
      const bool end = at == 0 || at == strand.parts * sample.graph.units;
      if (!end) {
        seen[dart].emplace(Key{dart >> 1, divided.number[r.vertex]}, point);
      }
      EXPECT_EQ(flat.number[r.vertex], divided.number[r.vertex]);
      EXPECT_EQ(flat.position[r.vertex], divided.position[r.vertex]);
      // The texture vertices there are at that parameter.
      ASSERT_FALSE(uv_of[r.vertex].empty());
      for (const std::uint32_t u : uv_of[r.vertex]) {
        std::uint32_t part = 0;
        while (flat.part_uv_begin[part + 1] <= u) {
          ++part;
        }
        Vec2d want;
        const double size = sample.graph.units;
        if (flat.kind != ChartKind::kSplit) {
          const std::array<Vec2d, 4> places{Vec2d(r.along, 0), Vec2d(size, r.along),
                                            Vec2d(size - r.along, size), Vec2d(0, size - r.along)};
          want = places[r.side];
        } else if (part == r.side) {
          ASSERT_LE(r.along, 1);
          want = {r.along, 0};
        } else {
          ASSERT_EQ(part, (r.side + 1) % sides);
          ASSERT_GE(r.along, 1);
          want = {0, 2 - r.along};
        }
        EXPECT_EQ(flat.uv[u], want);
      }
    }
  }
  for (const auto& [dart, points] : seen) {
    const auto other = seen.find(dart ^ 1U);
    if (sample.graph.strands[dart >> 1].boundary()) {
      continue;
    }
    ASSERT_NE(other, seen.end());
    ASSERT_EQ(points.size(), other->second.size());
    for (const auto& [key, p] : points) {
      const auto it = other->second.find(key);
      ASSERT_NE(it, other->second.end());
      EXPECT_EQ(p.at, it->second.at);
      EXPECT_EQ(p.position, it->second.position);
      EXPECT_EQ(p.colour, it->second.colour);
    }
  }
}

/// Both parts beside a spoke have the same parameters along it.
void expect_spokes_fit(const FlatChart& flat) {
  if (flat.kind != ChartKind::kSplit) {
    return;
  }
  const std::size_t parts = flat.part_begin.size() - 1;
  std::vector<std::map<std::uint32_t, double>> first(parts);
  std::vector<std::map<std::uint32_t, double>> second(parts);
  for (std::size_t p = 0; p < parts; ++p) {
    bool centre = false;
    for (std::uint32_t u = flat.part_uv_begin[p]; u < flat.part_uv_begin[p + 1]; ++u) {
      if (flat.uv[u].x() == 1) {
        first[p][flat.uv_vertex[u]] = flat.uv[u].y();
      }
      if (flat.uv[u].y() == 1) {
        second[(p + parts - 1) % parts][flat.uv_vertex[u]] = flat.uv[u].x();
      }
      centre = centre || (flat.uv[u] == Vec2d(1, 1) && flat.uv_vertex[u] == flat.centre);
    }
    EXPECT_TRUE(centre);
  }
  for (std::size_t p = 0; p < parts; ++p) {
    EXPECT_GE(first[p].size(), 2U);
    EXPECT_EQ(first[p], second[p]);
  }
}

void expect_all_well(const LayoutRecipe& recipe) {
  const SampleLayout sample = make_layout(recipe);
  const std::vector<FlatChart> charts = flatten_all(sample);
  ASSERT_FALSE(::testing::Test::HasFatalFailure());
  ASSERT_EQ(charts.size(), sample.charts.size());
  expect_continuous(sample, charts);
  for (const FlatChart& c : charts) {
    expect_spokes_fit(c);
  }
}

TEST(FlattenChart, UnfoldsPlanesToThemselves) {
  const SampleLayout sample = testing::plane_layout(3, 2, 6, 0.3, 1);
  const std::vector<FlatChart> charts = flatten_all(sample);
  expect_continuous(sample, charts);
  for (const FlatChart& c : charts) {
    EXPECT_EQ(c.kind, ChartKind::kUnfolded);
    EXPECT_EQ(c.nudged, 0U);
    for (std::size_t u = 0; u < c.uv.size(); ++u) {
      const Vec2d& want = sample.charts[c.chart].unfolded[c.uv_vertex[u]];
      EXPECT_LT((c.uv[u] - want).norm(), layout::kRimGrid);
    }
  }
}

TEST(FlattenChart, NudgesSliversWhereTheyAre) {
  // Vertices put next to the rim, to corners, to one another and onto edges.
  std::uint32_t nudged = 0;
  std::uint32_t unfolded = 0;
  std::uint32_t count = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    SampleLayout sample = testing::plane_layout(2, 2, 5, 0.3, seed);
    testing::Random random(seed);
    for (ChartMesh& c : sample.charts) {
      for (int i = 0; i < 2; ++i) {
        const auto t = c.triangle[static_cast<std::size_t>(random.next() *
                                                           static_cast<double>(c.triangle.size()))];
        const double share = random.next() < 0.5 ? 1 : random.next();
        // Its third corner nearly onto the first or the opposite edge.
        if (!(c.unfolded[t[2]].minCoeff() > 1e-6 && c.unfolded[t[2]].maxCoeff() < 1 - 1e-6)) {
          continue;
        }
        const double close = 1 - 1e-6 * random.next();
        const Vec2d uv = share * c.unfolded[t[0]] + (1 - share) * c.unfolded[t[1]];
        const Vec3d p = share * c.position[t[0]] + (1 - share) * c.position[t[1]];
        c.unfolded[t[2]] += close * (uv - c.unfolded[t[2]]);
        c.position[t[2]] += close * (p - c.position[t[2]]);
      }
    }
    for (const FlatChart& c : flatten_all(sample)) {
      ++count;
      unfolded += c.kind == ChartKind::kUnfolded ? 1 : 0;
      nudged += c.nudged;
    }
    ASSERT_FALSE(::testing::Test::HasFatalFailure());
  }
  EXPECT_GT(nudged, count);
  EXPECT_EQ(unfolded, count);
}

TEST(FlattenChart, FlattensTorus) {
  LayoutRecipe recipe = testing::torus_layout(4, 3, 5);
  recipe.colours = true;
  expect_all_well(recipe);
  recipe.even_steps = true;
  expect_all_well(recipe);
  for (const std::uint32_t parts : {2U, 3U}) {
    recipe.parts = parts;
    expect_all_well(recipe);
  }
}

TEST(FlattenChart, SplitsChartsOfThreeSides) {
  LayoutRecipe recipe = testing::octants(3);
  recipe.colours = true;
  expect_all_well(recipe);
}

TEST(FlattenChart, FlattensBesideClosedStrands) {
  for (const std::uint32_t parts : {3U, 4U, 5U}) {
    expect_all_well(testing::half_spheres(3, parts));
  }
}

TEST(FlattenChart, FlattensAChartThatMeetsItself) {
  LayoutRecipe recipe = testing::cut_torus(9, 7);
  recipe.colours = true;
  expect_all_well(recipe);
  recipe.parts = 2;
  expect_all_well(recipe);
}

TEST(FlattenChart, FlattensAnyNumberOfSides) {
  for (std::uint32_t sides = 3; sides <= 9; ++sides) {
    SCOPED_TRACE(sides);
    expect_all_well(testing::disk_layout(6, 36, sides));
    expect_all_well(testing::disk_layout(3, 2 * sides + 1, sides));
    LayoutRecipe closed = testing::disk_layout(4, 17, 0);
    closed.closed_parts = sides;
    expect_all_well(closed);
  }
}

TEST(FlattenChart, KeepsFingersLarge) {
  // A tube as long as many times its width in the middle of the chart.
  for (const std::uint32_t sides : {4U, 5U}) {
    for (const double length : {1.0, 4.0, 50.0}) {
      SCOPED_TRACE(length);
      expect_all_well(testing::disk_layout(60, 12, sides, [&](double radius, double angle) {
        const auto [sine, cosine] = exact::sincos(angle);
        const double across = radius > 0.5 ? 2 * radius - 0.9 : 0.1 * std::min(1.0, 10 * radius);
        return Vec3d(across * cosine, across * sine, length * std::max(0.0, 1 - 2 * radius));
      }));
    }
  }
}

TEST(FlattenChart, FlattensRaggedAndNoisyDisks) {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE(seed);
    LayoutRecipe recipe = testing::ragged_layout(
        seed, 12 + 4 * static_cast<std::uint32_t>(seed % 40), seed % 3 == 0 ? 3 + seed / 3 % 7 : 4);
    testing::disturb(recipe.mesh, seed % 4 * 0.5, seed % 5 * 0.05, seed);
    expect_all_well(recipe);
    ASSERT_FALSE(::testing::Test::HasFatalFailure());
  }
}

/// The charts of real lines.
SampleLayout extract(const testing::IndexedMesh& m, const testing::Fields& fields, double omega) {
  MemoryStore store;
  const ScanMesh mesh = testing::store_fields(store, m, fields, 100);
  TaskGraph graph({.threads = 1});
  ArrangementOptions options;
  options.omega = omega;
  options.density = 1;
  ChartExtraction report;
  const ChartLayout layout = *extract_charts(store, mesh, options, true, graph, report);
  SampleLayout sample{layout.graph, {}};
  for (std::uint32_t t = 0; t < mesh.layout.tile_count(); ++t) {
    for (ChartMesh& c :
         assemble_charts(load_pieces(store, layout, TileId(t)), layout, TileId(t), false)) {
      sample.charts.push_back(std::move(c));
    }
  }
  return sample;
}

TEST(FlattenChart, FlattensWhatLinesLeave) {
  std::array<std::uint32_t, 3> kinds{};
  for (const testing::IndexedMesh& m :
       {testing::grid(30, 24), testing::torus(36, 18), testing::sphere(4, 8.0),
        testing::plate({"####", "#..#", "####"}, 4)}) {
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
      SCOPED_TRACE(m.name + ", seed " + std::to_string(seed));
      testing::Random random(seed);
      const double omega = 4.3 + static_cast<double>(seed);
      testing::Fields f = testing::linear_fields(m, Vec3d(0.7, 0.2, 0.5), omega);
      const testing::Fields noise = testing::random_fields(m, seed);
      for (std::size_t v = 0; v < f.frames.size(); ++v) {
        if (random.next() < 0.01 * static_cast<double>(seed % 4)) {
          f.phases[v] = noise.phases[v];
        }
      }
      const SampleLayout sample = extract(m, f, omega);
      const std::vector<FlatChart> charts = flatten_all(sample);
      ASSERT_FALSE(::testing::Test::HasFatalFailure());
      expect_continuous(sample, charts);
      for (const FlatChart& c : charts) {
        expect_spokes_fit(c);
        ++kinds[static_cast<std::size_t>(c.kind)];
        if (c.kind != ChartKind::kUnfolded && !sample.charts[c.chart].unfolded.empty()) {
          ADD_FAILURE() << "not unfolded";
        }
      }
      ASSERT_FALSE(::testing::Test::HasFailure());
    }
  }
  for (const std::uint32_t n : kinds) {
    EXPECT_GT(n, 10U);
  }
}

TEST(FlattenChart, FlattensWhereAllIsInOnePlace) {
  LayoutRecipe recipe = testing::disk_layout(5, 16, 4);
  for (Vec3d& p : recipe.mesh.positions) {
    p = Vec3d(1, 2, 3);
  }
  expect_all_well(recipe);
}

TEST(FlattenChart, RejectsWhatIsNoDisk) {
  SampleLayout sample = testing::plane_layout(1, 1, 4, 0, 1);
  ChartMesh hole = sample.charts[0];
  hole.triangle.erase(hole.triangle.begin() + 12);
  hole.dart.erase(hole.dart.begin() + 12);
  hole.step.erase(hole.step.begin() + 12);
  EXPECT_THROW(flatten_chart(std::move(hole), sample.graph), InternalError);
  ChartMesh twisted = sample.charts[0];
  std::swap(twisted.triangle[5][0], twisted.triangle[5][1]);
  EXPECT_THROW(flatten_chart(std::move(twisted), sample.graph), InternalError);
  ChartMesh turned = sample.charts[0];
  for (auto& dart : turned.dart) {
    for (std::uint32_t& d : dart) {
      d = d == sample.graph.ring(0)[1] ? sample.graph.ring(0)[2] : d;
    }
  }
  EXPECT_THROW(flatten_chart(std::move(turned), sample.graph), InternalError);
}

TEST(ConvexMap, ReproducesAffineMaps) {
  // Mean value weights have linear precision.
  SampleLayout sample = testing::plane_layout(1, 1, 9, 0.35, 7);
  FlatDisk disk;
  disk.position = sample.charts[0].position;
  disk.triangle = sample.charts[0].triangle;
  disk.given = static_cast<std::uint32_t>(disk.position.size());
  Eigen::Matrix2d a;
  a << 2, 0.5, -0.3, 1.2;
  std::vector<Vec2d> want;
  for (const Vec3d& p : disk.position) {
    const bool inside = p.head<2>().minCoeff() > 1e-9 && p.head<2>().maxCoeff() < 1 - 1e-9;
    disk.fixed.push_back(inside ? 0 : 1);
    want.push_back(a * p.head<2>() + Vec2d(3, 4));
    disk.uv.push_back(inside ? Vec2d(0, 0) : want.back());
  }
  layout::ConvexMap(disk).solve(disk.uv);
  for (std::size_t v = 0; v < want.size(); ++v) {
    EXPECT_LT((disk.uv[v] - want[v]).norm(), 1e-12);
  }
  // So an isometry has stretch 1, and reweighting leaves it.
  disk.uv.clear();
  for (const Vec3d& p : disk.position) {
    disk.uv.emplace_back(p.head<2>());
  }
  EXPECT_NEAR(layout::mean_stretch(disk), 1, 1e-12);
  EXPECT_EQ(layout::map_to_square(disk).nudged, 0U);
  EXPECT_NEAR(layout::mean_stretch(disk), 1, 1e-9);
}

TEST(ConvexMap, ReweightingLowersStretch) {
  const SampleLayout sample = make_layout(testing::half_spheres(4, 4));
  ChartMesh mesh = sample.charts[0];
  const std::vector<RimVertex> rim = layout::divide_sides(mesh, sample.graph);
  FlatDisk disk;
  disk.position = mesh.position;
  disk.triangle = mesh.triangle;
  disk.given = static_cast<std::uint32_t>(mesh.position.size());
  disk.fixed.assign(disk.given, 0);
  disk.uv.assign(disk.given, Vec2d::Zero());
  for (const RimVertex& r : rim) {
    disk.fixed[r.vertex] = 1;
    const std::array<Vec2d, 4> places{Vec2d(r.along, 0), Vec2d(1, r.along), Vec2d(1 - r.along, 1),
                                      Vec2d(0, 1 - r.along)};
    disk.uv[r.vertex] = places[r.side];
  }
  layout::split_chords(disk, layout::Chords::kNeeded);
  layout::ConvexMap map(disk);
  map.solve(disk.uv);
  const double first = layout::mean_stretch(disk);
  layout::map_to_square(disk);
  EXPECT_LT(layout::mean_stretch(disk), 0.97 * first);
}

}  // namespace
}  // namespace rattan
