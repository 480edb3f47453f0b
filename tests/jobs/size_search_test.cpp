// SPDX-License-Identifier: MIT
#include "jobs/size_search.h"

#include <cmath>

#include <gtest/gtest.h>

namespace rattan {
namespace {

TEST(SizeSearch, TakesTheFirstTryThatIsNear) {
  SizeSearch search(1000.0, 2.0);
  EXPECT_EQ(search.side(), 2.0);
  search.tell(1040.0);
  EXPECT_TRUE(search.done());
  EXPECT_EQ(search.best_side(), 2.0);
}

TEST(SizeSearch, FollowsTheAreaAndTheLength) {
  for (const double power : {2.0, 1.0}) {
    SizeSearch search(1000.0, 1.0);
    double faces = 0.0;
    while (!search.done()) {
      faces = 3e4 / std::pow(search.side(), power);
      search.tell(faces);
    }
    EXPECT_NEAR(faces, 1000.0, 150.0) << power;
    EXPECT_NEAR(search.best_side(), std::pow(30.0, 1.0 / power), 3.0) << power;
  }
}

TEST(SizeSearch, EndsWhereTheCountStays) {
  SizeSearch search(100.0, 1.0);
  int tries = 0;
  while (!search.done()) {
    search.tell(4000.0);
    ++tries;
  }
  EXPECT_EQ(tries, 2);
}

TEST(SizeSearch, UncountedTriesLeadToLargerSidesAndAreNoResult) {
  SizeSearch search(1000.0, 1.0);
  int uncounted = 0;
  while (!search.done()) {
    const double faces = 1e12 / (search.side() * search.side());
    if (faces > 1e5) {
      const double side = search.side();
      search.tell_more_than(1e5);
      EXPECT_GE(search.side(), 2.0 * side);
      ++uncounted;
    } else {
      search.tell(faces);
    }
  }
  EXPECT_GT(uncounted, 3);
  EXPECT_NEAR(1e12 / (search.best_side() * search.best_side()), 1000.0, 90.0);
}

}  // namespace
}  // namespace rattan
