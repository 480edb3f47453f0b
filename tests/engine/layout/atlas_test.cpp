// SPDX-License-Identifier: MIT
#include "engine/layout/atlas.h"

#include <algorithm>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "tests/engine/layout/memory_layout.h"

namespace rattan {
namespace {

using testing::MemoryLayout;

struct Mixture {
  std::uint32_t charts;
  std::uint32_t split_every;  // 0: none
  std::uint32_t image;
  std::uint32_t gutter;
};

std::vector<std::uint32_t> mixture(const Mixture& m) {
  static constexpr std::uint32_t kSides[] = {3, 5, 1, 6, 2, 7};
  std::vector<std::uint32_t> parts(m.charts, 0);
  for (std::uint32_t c = 0; m.split_every > 0 && c < m.charts; c += m.split_every) {
    parts[c] = kSides[c / m.split_every % 6];
  }
  return parts;
}

class AtlasPlans : public ::testing::TestWithParam<Mixture> {};

// On a map of texels: each belongs to at most one part, the parts with half a gutter around them
// stay within their own, and no two parts are nearer than the gutter.
TEST_P(AtlasPlans, KeepPartsApart) {
  const auto parts = mixture(GetParam());
  const LayoutSize size = testing::size_of(parts);
  const AtlasPlan plan(size, parts, {GetParam().image, GetParam().gutter});
  ASSERT_EQ(plan.parts(), size.parts);
  const std::uint32_t n = plan.size();
  const std::uint32_t gutter = GetParam().gutter;
  std::vector<std::uint32_t> owner(std::size_t{n} * n, 0);
  std::vector<double> units;
  for (const std::uint32_t c : parts) {
    units.insert(units.end(), std::max(c, 1U), c == 0 ? size.units : 1.0);
  }
  double area = 0.0;
  for (std::uint32_t p = 0; p < plan.parts(); ++p) {
    const AtlasPart part = plan.part(p);
    ASSERT_GE(part.side, 1U);
    ASSERT_GE(part.x, part.x_begin + gutter / 2);
    ASSERT_GE(part.y, part.y_begin + gutter / 2);
    // The next part's first texel is as far again from x_end as this one's from x_begin.
    ASSERT_LE(part.x + part.side + gutter, part.x_end + gutter / 2);
    ASSERT_LE(part.y + part.side + gutter, part.y_end + gutter / 2);
    ASSERT_LE(part.x_end, n);
    ASSERT_LE(part.y_end, n);
    for (std::uint32_t y = part.y_begin; y < part.y_end; ++y) {
      for (std::uint32_t x = part.x_begin; x < part.x_end; ++x) {
        ASSERT_EQ(owner[std::size_t{y} * n + x], 0U) << "part " << p;
        owner[std::size_t{y} * n + x] = p + 1;
      }
    }
    area += double(part.side) * part.side / n / n;
    const AtlasMap map = plan.map(p);
    EXPECT_GE(map.origin.minCoeff(), 0.0);
    EXPECT_LE((map.origin + Vec2d::Constant(map.scale * units[p])).maxCoeff(), 1.0);
    EXPECT_NEAR(map.scale * units[p] * n, part.side, 1e-9 * n);
  }
  EXPECT_NEAR(plan.efficiency(), area, 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Mixtures, AtlasPlans,
                         ::testing::Values(Mixture{1, 0, 64, 4}, Mixture{1, 1, 64, 1},
                                           Mixture{5, 0, 100, 4}, Mixture{5, 2, 101, 3},
                                           Mixture{64, 0, 512, 4}, Mixture{257, 9, 1000, 4},
                                           Mixture{2000, 20, 2048, 4}, Mixture{999, 1, 777, 2},
                                           Mixture{12, 1, 333, 8}));

TEST(Atlas, WholeChartsFillMostOfIt) {
  const std::vector<std::uint32_t> parts = mixture({10000, 25, 0, 4});
  EXPECT_GT(AtlasPlan(testing::size_of(parts), parts).efficiency(), 0.77);
  const std::vector<std::uint32_t> few = mixture({400, 0, 0, 4});
  EXPECT_GT(AtlasPlan(testing::size_of(few), few).efficiency(), 0.95);
  EXPECT_GT(AtlasPlan(testing::size_of(few), few, {4096, 4}).efficiency(), 0.93);
}

// Wherever the plan is a square of a power of two, charts of successive numbers share a side; else
// nearly all do.
TEST(Atlas, NearNumbersAreNear) {
  for (const std::uint32_t charts : {1024U, 1000U, 5000U}) {
    const std::vector<std::uint32_t> parts(charts, 0);
    const AtlasPlan plan(testing::size_of(parts), parts, {4096, 4});
    std::uint32_t neighbours = 0;
    for (std::uint32_t c = 0; c + 1 < charts; ++c) {
      const AtlasPart a = plan.part(c);
      const AtlasPart b = plan.part(c + 1);
      const auto apart = [](std::uint32_t s, std::uint32_t t) { return s < t ? t - s : s - t; };
      neighbours += apart(a.x, b.x) + apart(a.y, b.y) < 2 * (a.side + 4) ? 1 : 0;
    }
    if (charts == 1024) {
      EXPECT_EQ(neighbours, charts - 1);
    }
    EXPECT_GT(neighbours, charts * 95 / 100);
  }
}

TEST(Atlas, RefusesAnImageThatIsTooSmall) {
  const std::vector<std::uint32_t> parts = mixture({1000, 10, 0, 4});
  const LayoutSize size = testing::size_of(parts);
  std::uint32_t least = 0;
  try {
    AtlasPlan(size, parts, {64, 4});
    FAIL() << "64 texels for 1000 charts";
  } catch (const UsageError& error) {
    const std::string text = error.what();
    const std::size_t at = text.find("it takes ");
    ASSERT_NE(at, std::string::npos) << text;
    least = static_cast<std::uint32_t>(std::stoul(text.substr(at + 9)));
  }
  EXPECT_NO_THROW(AtlasPlan(size, parts, {least, 4}));
  EXPECT_THROW(AtlasPlan(size, parts, {least - 1, 4}), UsageError);
}

// Every texture vertex lies in its own part, parts in order; the map is a scale and a shift, so
// texture areas shrink by one factor a part and no triangle folds, in single precision neither.
TEST(Atlas, MapsPartsByScaleAndShift) {
  MemoryLayout layout = testing::sheet_layout(9, 7, 3, [](std::uint32_t c) { return c % 5 == 2; });
  const auto parts = split_parts(layout);
  ASSERT_EQ(parts[2], 4U);
  ASSERT_EQ(parts[3], 0U);
  for (const std::uint32_t image : {0U, 512U, 1000U}) {
    const AtlasPlan plan(layout.size(), parts, {image, 4});
    AtlasSource atlas(layout, plan);
    EXPECT_EQ(atlas.size().texture_vertices, layout.size().texture_vertices);
    std::uint32_t charts = 0;
    atlas.for_each_chart([&](const LayoutChart& chart) {
      const FlatChart& flat = layout.charts[charts++];
      ASSERT_EQ(chart.uv.size(), flat.uv.size());
      EXPECT_EQ(folded_in_single(chart), 0U);
      for (std::size_t k = 0; k + 1 < chart.part_begin.size(); ++k) {
        const AtlasPart part = plan.part(chart.first_part + k);
        const double units = chart.kind == ChartKind::kSplit ? 1.0 : 2.0;
        for (std::size_t i = chart.part_uv_begin[k]; i < chart.part_uv_begin[k + 1]; ++i) {
          const Vec2d texel = chart.uv[i] * plan.size() - Vec2d::Constant(0.5);
          EXPECT_NEAR(texel.x(), part.x + part.side * flat.uv[i].x() / units, 1e-6 * plan.size());
          EXPECT_NEAR(texel.y(), part.y + part.side * flat.uv[i].y() / units, 1e-6 * plan.size());
          EXPECT_GE(texel.x(), part.x_begin);
          EXPECT_GE(texel.y(), part.y_begin);
          EXPECT_LE(texel.x(), part.x_end - 1.0);
          EXPECT_LE(texel.y(), part.y_end - 1.0);
        }
      }
    });
    EXPECT_EQ(charts, layout.charts.size());
  }
}

TEST(Atlas, FindsWhatSinglePrecisionFolds) {
  LayoutChart chart;
  const std::vector<Vec2d> uv = {{0.5, 0.5}, {0.75, 0.5}, {0.625, 0.5 + 1e-9}, {0.625, 0.5 + 1e-6}};
  const std::vector<std::array<std::uint32_t, 3>> triangle = {{0, 1, 2}, {0, 1, 3}};
  chart.uv = uv;
  chart.triangle = triangle;
  EXPECT_EQ(folded_in_single(chart), 1U);
}

// Corners of an atlas without an image are exact in single precision, so what is regular stays so
// with any number of charts.
TEST(Atlas, CornersAreExactInSinglePrecision) {
  const std::vector<std::uint32_t> parts = mixture({60000, 30, 0, 4});
  const AtlasPlan plan(testing::size_of(parts), parts);
  for (std::uint32_t p = 0; p < plan.parts(); p += 7) {
    const Vec2d origin = plan.map(p).origin;
    EXPECT_EQ(static_cast<double>(static_cast<float>(origin.x())), origin.x());
    EXPECT_EQ(static_cast<double>(static_cast<float>(origin.y())), origin.y());
  }
}

}  // namespace
}  // namespace rattan
