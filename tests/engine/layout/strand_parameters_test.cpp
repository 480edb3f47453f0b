// SPDX-License-Identifier: MIT
#include "engine/layout/strand_parameters.h"

#include <cmath>

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "tests/engine/layout/sample_meshes.h"

namespace rattan::layout {
namespace {

std::vector<Vec3d> on_line(const std::vector<double>& x) {
  std::vector<Vec3d> points;
  for (const double v : x) {
    points.emplace_back(v, 0, 0);
  }
  return points;
}

void expect_valid(const std::vector<StrandPoint>& points, std::size_t given, std::uint32_t parts,
                  std::uint32_t units) {
  const std::uint32_t length = parts * units;
  ASSERT_EQ(points.front().at, 0);
  ASSERT_EQ(points.back().at, length);
  std::uint32_t divisions = 0;
  std::uint32_t old = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const StrandPoint& p = points[i];
    EXPECT_EQ(p.at / kRimGrid, std::floor(p.at / kRimGrid));
    if (p.division) {
      EXPECT_EQ(p.at, divisions);
      ++divisions;
    }
    if (p.made) {
      EXPECT_TRUE(p.division);
      EXPECT_GT(p.share, 0);
      EXPECT_LT(p.share, 1);
      EXPECT_EQ(p.point + 1, old);
    } else {
      EXPECT_EQ(p.point, old);
      ++old;
    }
    if (i > 0) {
      EXPECT_GT(p.at, points[i - 1].at);
      if (points.size() < 300) {
        EXPECT_GE(p.at - points[i - 1].at, kLeastGap);
      }
    }
  }
  EXPECT_EQ(old, given);
  EXPECT_EQ(divisions, length + 1);
}

TEST(StrandParameters, FollowsStepsWhereTheyCoverAPeriod) {
  const auto points =
      strand_parameters(on_line({0, 1, 2, 10}), std::vector<double>{0.125, 0.5, 0.375}, 1, 1);
  ASSERT_EQ(points.size(), 4U);
  EXPECT_EQ(points[1].at, 0.125);
  EXPECT_EQ(points[2].at, 0.625);
  // Three periods, three parts: a vertex near enough to the first division serves as it.
  const auto three =
      strand_parameters(on_line({0, 1, 2, 10}), std::vector<double>{0.125, 0.877, 1.998}, 3, 1);
  ASSERT_EQ(three.size(), 5U);
  EXPECT_EQ(three[2].at, 1);
  EXPECT_FALSE(three[2].made);
  EXPECT_TRUE(three[2].division);
  EXPECT_TRUE(three[3].made);
  EXPECT_EQ(three[3].point, 2U);
  EXPECT_NEAR(three[3].share, 0.998 / 1.998, 1e-12);
}

TEST(StrandParameters, FollowsArcLengthElse) {
  const std::vector<Vec3d> line = on_line({0, 1, 2, 4});
  for (const auto& step : {std::vector<double>{0.2, -1, 0.8}, {0.2, 0.2, 0.2}, {0, 0, 0}}) {
    const auto points = strand_parameters(line, step, 1, 1);
    ASSERT_EQ(points.size(), 4U);
    EXPECT_EQ(points[1].at, 0.25);
    EXPECT_EQ(points[2].at, 0.5);
  }
  const auto halved = strand_parameters(line, std::vector<double>{-1, -1, -1}, 1, 2);
  ASSERT_EQ(halved.size(), 4U);
  EXPECT_EQ(halved[2].at, 1);
  EXPECT_TRUE(halved[2].division);
}

TEST(StrandParameters, KeepsGapsWhateverThePoints) {
  testing::Random random(3);
  for (std::uint32_t i = 0; i < 400; ++i) {
    const auto n = 1 + static_cast<std::size_t>(random.next() * (i % 40 == 0 ? 4000 : 30));
    const auto parts = 1 + static_cast<std::uint32_t>(random.next() * 4);
    const std::uint32_t units = 1 + i % 2;
    std::vector<Vec3d> position{Vec3d::Zero()};
    std::vector<double> step;
    for (std::size_t k = 0; k < n; ++k) {
      const double length = random.next() < 0.3 ? 0 : std::pow(random.next(), 8);
      position.push_back(position.back() + Vec3d(0, length, 0));
      step.push_back(i % 3 == 0 ? -1 : length);
    }
    if (i % 3 == 1 && position.back().y() > 0) {
      for (double& s : step) {
        s *= parts / position.back().y();
      }
    }
    if (i % 50 == 1) {
      position.assign(n + 1, Vec3d(1, 2, 3));
    }
    const auto points = strand_parameters(position, step, parts, units);
    expect_valid(points, n + 1, parts, units);
    // As its own wish it stays as it is; other wishes are moved into order.
    std::vector<double> given;
    for (const StrandPoint& p : points) {
      given.push_back(p.at);
    }
    const auto again = strand_parameters(position, step, parts, units, given);
    for (std::size_t k = 0; k < points.size(); ++k) {
      ASSERT_EQ(points[k].at, again[k].at);
      given[k] = random.next() * parts * units;
    }
    expect_valid(strand_parameters(position, step, parts, units, given), n + 1, parts, units);
    if (::testing::Test::HasFailure()) {
      return;
    }
  }
}

}  // namespace
}  // namespace rattan::layout
