// SPDX-License-Identifier: MIT
#include "engine/layout/relax.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "engine/layout/flat_disk.h"
#include "engine/layout/flatten_chart.h"
#include "tests/engine/layout/sample_layouts.h"

namespace rattan {
namespace {

using testing::LayoutRecipe;
using testing::make_layout;
using testing::SampleLayout;

std::vector<FlatChart> flatten_all(const SampleLayout& sample, const FlattenOptions& options) {
  std::vector<FlatChart> charts;
  for (const ChartMesh& c : sample.charts) {
    ChartMesh copy = c;
    charts.push_back(flatten_chart(std::move(copy), sample.graph, options));
  }
  return charts;
}

/// How far each round moves points, at most.
std::vector<double> relax(const SampleLayout& sample, StrandRelaxation& relaxation, int rounds,
                          bool backwards = false) {
  std::vector<double> moves;
  for (int i = 0; i < rounds; ++i) {
    std::vector<FlatChart> charts = flatten_all(sample, {relaxation.given()});
    if (backwards) {
      std::reverse(charts.begin(), charts.end());
    }
    for (const FlatChart& c : charts) {
      if (relaxation.touches(c.chart)) {
        relaxation.add(rim_wishes(c, sample.graph));
      }
    }
    moves.push_back(relaxation.end_round());
  }
  return moves;
}

/// Root mean square over all triangles of the ratio between flat and true lengths, off its mean:
/// 0 for an isometry up to size.
double distortion(const std::vector<FlatChart>& charts) {
  double sum = 0;
  double area = 0;
  double whole = 0;
  for (const FlatChart& c : charts) {
    for (const auto& t : c.triangle) {
      const Vec3d e1 = c.position[c.uv_vertex[t[1]]] - c.position[c.uv_vertex[t[0]]];
      const Vec3d e2 = c.position[c.uv_vertex[t[2]]] - c.position[c.uv_vertex[t[0]]];
      const double doubled = e1.cross(e2).norm();
      const double flat = layout::doubled_area(c.uv[t[0]], c.uv[t[1]], c.uv[t[2]]);
      const Vec2d p = c.uv[t[1]] - c.uv[t[0]];
      const Vec2d q = c.uv[t[2]] - c.uv[t[0]];
      const Vec3d du = (e1 * q.y() - e2 * p.y()) / flat;
      const Vec3d dv = (e2 * p.x() - e1 * q.x()) / flat;
      sum += doubled * 0.5 * (du.squaredNorm() + dv.squaredNorm());
      area += doubled;
      whole += flat;
    }
  }
  return std::sqrt(sum / area * whole / area) - 1;
}

/// A plane of square charts whose strands inside are parameterized badly: even steps though the
/// vertices are not even.
SampleLayout uneven_plane() {
  SampleLayout sample = testing::plane_layout(3, 3, 8, 0.0, 1);
  std::fill(sample.graph.chart_singular.begin(), sample.graph.chart_singular.end(), 1);
  for (ChartMesh& c : sample.charts) {
    c.unfolded.clear();
    for (Vec3d& p : c.position) {
      const auto bend = [](double x) {
        const double whole = std::floor(x);
        const double rest = x - whole;
        return whole + rest + 0.6 * rest * (1 - rest);
      };
      // Boundary strands stay, so they keep even steps.
      const bool rim = p.x() < 1e-9 || p.y() < 1e-9 || p.x() > 3 - 1e-9 || p.y() > 3 - 1e-9;
      p = rim ? p : Vec3d(bend(p.x()), bend(p.y()), 0);
    }
  }
  return sample;
}

TEST(Relax, FindsTheIsometryAcrossStrands) {
  const SampleLayout sample = uneven_plane();
  StrandRelaxation relaxation(sample.graph);
  const double before = distortion(flatten_all(sample, {}));
  const std::vector<double> moves = relax(sample, relaxation, 12);
  const std::vector<FlatChart> charts = flatten_all(sample, {relaxation.given()});
  for (const FlatChart& c : charts) {
    testing::expect_flat(c, sample.charts[c.chart], sample.graph);
  }
  EXPECT_GT(before, 0.02);
  EXPECT_LT(distortion(charts), 0.25 * before);
  EXPECT_LT(moves.back(), 0.1 * moves.front());
}

TEST(Relax, LeavesWhatIsSmooth) {
  // Charts that fit one another as they are stay, but for rounding.
  SampleLayout sample = testing::plane_layout(3, 3, 6, 0.2, 5);
  std::fill(sample.graph.chart_singular.begin(), sample.graph.chart_singular.end(), 1);
  StrandRelaxation relaxation(sample.graph);
  EXPECT_LT(relax(sample, relaxation, 1).front(), 1e-4);
}

TEST(Relax, StaysValidAndContinuous) {
  for (std::uint32_t i = 0; i < 5; ++i) {
    LayoutRecipe recipe = i == 0   ? testing::octants(3)
                          : i == 1 ? testing::half_spheres(3, 5)
                          : i == 2 ? testing::cut_torus(12, 9)
                                   : testing::torus_layout(3, 3, 4);
    recipe.parts = i == 4 ? 2 : 1;
    testing::disturb(recipe.mesh, 0.05, 0, i);
    SampleLayout sample = make_layout(recipe);
    std::fill(sample.graph.chart_singular.begin(), sample.graph.chart_singular.end(), 1);
    StrandRelaxation relaxation(sample.graph);
    const std::vector<double> moves = relax(sample, relaxation, kRelaxRounds);
    EXPECT_GT(moves.front(), 0);
    EXPECT_LT(moves.back(), moves.front());
    StrandRelaxation other(sample.graph);
    EXPECT_EQ(relax(sample, other, kRelaxRounds, true), moves);
    for (const FlatChart& c : flatten_all(sample, {relaxation.given()})) {
      testing::expect_flat(c, sample.charts[c.chart], sample.graph);
      // Both charts of each strand agree: add() makes sure.
      relaxation.add(rim_wishes(c, sample.graph));
    }
    relaxation.end_round();
  }
}

TEST(Relax, MovesOnlyStrandsBesideRepairedCharts) {
  SampleLayout sample = testing::plane_layout(4, 1, 4, 0.1, 2);
  sample.graph.chart_singular[0] = 1;
  const StrandRelaxation relaxation(sample.graph);
  for (std::uint32_t s = 0; s < sample.graph.strands.size(); ++s) {
    const ChartStrand& strand = sample.graph.strands[s];
    EXPECT_EQ(relaxation.moves(s),
              !strand.boundary() && (strand.chart[0] == 0 || strand.chart[1] == 0));
  }
  EXPECT_TRUE(relaxation.touches(1));
  EXPECT_FALSE(relaxation.touches(2));
  StrandRelaxation incomplete(sample.graph);
  EXPECT_THROW(incomplete.end_round(), InternalError);
}

}  // namespace
}  // namespace rattan
