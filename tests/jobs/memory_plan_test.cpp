// SPDX-License-Identifier: MIT
#include "jobs/memory_plan.h"

#include <string>

#include <gtest/gtest.h>

#include "engine/core/errors.h"

namespace rattan {
namespace {

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;

TEST(MemoryPlan, KeepsTilesInFlightWithinAQuarter) {
  EXPECT_EQ(tiles_in_flight(4096 * kMiB, 2), 6);
  EXPECT_EQ(tiles_in_flight(4096 * kMiB, 1000), 256);
  EXPECT_EQ(tiles_in_flight(kMiB, 64), 2);
}

TEST(MemoryPlan, FitsTheSmallBudgetsThatAreKnownToDo) {
  EXPECT_NO_THROW(check_memory({800000, 50000.0, 2}, 128 * kMiB, "s"));
  EXPECT_NO_THROW(check_memory({12800000, 500000.0, 2}, 1024 * kMiB, "s"));
}

TEST(MemoryPlan, SaysWhatWouldDo) {
  const MemoryWish wish{3200000, 400000.0, 64};
  const std::uint64_t least = least_budget(wish);
  try {
    check_memory(wish, 256 * kMiB, "scan.ply");
    FAIL();
  } catch (const ResourceError& e) {
    const std::string text = e.what();
    EXPECT_NE(text.find("scan.ply: a memory budget of 256 MiB is too small"), std::string::npos);
    EXPECT_NE(text.find("--memory " + std::to_string(least / kMiB) + "MiB"), std::string::npos);
    EXPECT_NE(text.find("or ask for fewer faces"), std::string::npos);
  }
  EXPECT_NO_THROW(check_memory(wish, least, "scan.ply"));
  EXPECT_THROW(check_memory(wish, least - kMiB, "scan.ply"), ResourceError);
}

}  // namespace
}  // namespace rattan
