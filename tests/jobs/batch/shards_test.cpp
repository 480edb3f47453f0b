// SPDX-License-Identifier: MIT
#include "jobs/batch/shards.h"

#include <algorithm>
#include <numeric>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace rattan {
namespace {

std::vector<double> sums(const std::vector<double>& costs, const std::vector<std::uint32_t>& part,
                         std::uint32_t parts) {
  std::vector<double> sum(parts);
  for (std::size_t i = 0; i < costs.size(); ++i) {
    sum.at(part[i]) += costs[i];
  }
  return sum;
}

TEST(Shards, PutsTheCostliestFirst) {
  const std::vector<double> costs = {1, 7, 5, 3};
  EXPECT_EQ(pack(costs, 2), (std::vector<std::uint32_t>{0, 0, 1, 1}));
}

TEST(Shards, EachInOnePartAndNearlyEven) {
  std::mt19937 random(5);
  for (const std::uint32_t parts : {1U, 2U, 7U, 40U}) {
    std::vector<double> costs(1000);
    for (double& cost : costs) {
      cost = static_cast<double>(random() % 1000) / 10.0;
    }
    costs[17] = 100.0;
    const std::vector<std::uint32_t> part = pack(costs, parts);
    EXPECT_EQ(part, pack(costs, parts));
    const std::vector<double> sum = sums(costs, part, parts);
    const double all = std::accumulate(costs.begin(), costs.end(), 0.0);
    // Graham: no part is larger than the mean and the last, smallest scans put into it.
    EXPECT_LE(*std::max_element(sum.begin(), sum.end()), all / parts * 1.01 + 1.0);
  }
}

TEST(Shards, SpreadsWhatCostsNothing) {
  const std::vector<double> costs(9, 0.0);
  EXPECT_EQ(pack(costs, 3), (std::vector<std::uint32_t>{0, 1, 2, 0, 1, 2, 0, 1, 2}));
}

TEST(Shards, PartsMayStayEmpty) {
  EXPECT_EQ(pack(std::vector<double>{2.0}, 4), (std::vector<std::uint32_t>{0}));
  EXPECT_TRUE(pack({}, 4).empty());
}

}  // namespace
}  // namespace rattan
