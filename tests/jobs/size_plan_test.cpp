// SPDX-License-Identifier: MIT
#include "jobs/size_plan.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace rattan {
namespace {

using Plan = std::vector<std::pair<std::size_t, std::size_t>>;  // size, owner (itself if its own)

Plan plan(const std::vector<double>& faces, int density) {
  Plan result;
  for (const PlannedSize& p : plan_sizes(faces, density)) {
    EXPECT_EQ(p.owner.has_value(), p.multiple > 1);
    result.emplace_back(p.size, p.owner.value_or(p.size));
  }
  return result;
}

TEST(SizePlan, OneSizeHasItsOwn) {
  EXPECT_EQ(plan({500}, 2), (Plan{{0, 0}}));
}

TEST(SizePlan, FourTimesTheFacesShare) {
  EXPECT_EQ(plan({10000, 2500}, 2), (Plan{{1, 1}, {0, 1}}));
  EXPECT_EQ(plan({10000, 2000}, 2), (Plan{{1, 1}, {0, 0}}));
  EXPECT_EQ(plan({10000, 2500}, 3), (Plan{{1, 1}, {0, 0}}));
}

TEST(SizePlan, FewestLinesWinAndOwnersDoNotShare) {
  // 16000 is made from 4000, not from 1000; so 4000 has its own.
  EXPECT_EQ(plan({1000, 4000, 16000}, 1), (Plan{{0, 0}, {1, 1}, {2, 1}}));
  // Members follow their owner before another owner is solved.
  EXPECT_EQ(plan({16000, 900, 3600, 4000, 8100}, 1),
            (Plan{{1, 1}, {2, 1}, {4, 1}, {3, 3}, {0, 3}}));
}

TEST(SizePlan, EverySizeOnceAndOwnersFirst) {
  std::mt19937_64 random(7);
  for (int round = 0; round < 2000; ++round) {
    std::vector<double> faces(1 + random() % 8);
    for (double& f : faces) {
      f = std::pow(2.0, static_cast<double>(random() % 30) / 2.0) * 100.0;
    }
    const int density = 1 + static_cast<int>(random() % 4);
    std::vector<int> made(faces.size(), 0);
    std::size_t current = faces.size();
    for (const PlannedSize& p : plan_sizes(faces, density)) {
      ++made[p.size];
      if (!p.owner) {
        current = p.size;
        continue;
      }
      EXPECT_EQ(*p.owner, current);
      EXPECT_LE(p.multiple * density, 4);
      EXPECT_NEAR(faces[current] * p.multiple * p.multiple / faces[p.size], 1.0, 0.15);
    }
    EXPECT_TRUE(std::all_of(made.begin(), made.end(), [](int n) { return n == 1; }));
  }
}

}  // namespace
}  // namespace rattan
