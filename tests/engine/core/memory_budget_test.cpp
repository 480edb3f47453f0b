// SPDX-License-Identifier: MIT
#include "engine/core/memory_budget.h"

#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "engine/core/resident_memory.h"

namespace rattan {
namespace {

TEST(MemoryBudget, KeepsTheLedger) {
  MemoryBudget budget(1000);
  {
    Reservation a = budget.reserve(400, "a");
    Reservation b = budget.reserve(600, "b");
    EXPECT_EQ(budget.available(), 0U);
    EXPECT_EQ(budget.try_reserve(1, "c").bytes(), 0U);
    b.resize(100);
    EXPECT_EQ(budget.used(), 500U);
    Reservation moved = std::move(a);
    EXPECT_EQ(a.bytes(), 0U);  // NOLINT(bugprone-use-after-move): what a move leaves is promised
    EXPECT_EQ(moved.bytes(), 400U);
    moved = budget.reserve(300, "d");
    EXPECT_EQ(budget.used(), 400U);
    moved.release();
    EXPECT_EQ(budget.used(), 100U);
    EXPECT_THROW(b.resize(1001), ResourceError);
    EXPECT_EQ(b.bytes(), 100U);
  }
  EXPECT_EQ(budget.used(), 0U);
  EXPECT_EQ(budget.peak(), 1000U);
}

TEST(MemoryBudget, SaysWhatWouldDo) {
  MemoryBudget budget(std::uint64_t{3} << 20);
  const Reservation a = budget.reserve(std::uint64_t{2} << 20, "tiles");
  try {
    budget.reserve(std::uint64_t{14} << 20, "sorting the scan");
    FAIL();
  } catch (const ResourceError& e) {
    EXPECT_EQ(std::string(e.what()),
              "Not enough memory for sorting the scan: 14 MiB more are needed, but 2.0 MiB of "
              "3.0 MiB are in use. Allow at least 16 MiB.");
  }
  EXPECT_EQ(format_bytes(17), "17 bytes");
  EXPECT_EQ(format_bytes(1536), "1.5 KiB");
}

TEST(MemoryBudget, LeavesTheCacheTheRest) {
  const std::uint64_t resident = resident_bytes();
  ASSERT_GT(resident, 0U);
  constexpr std::uint64_t kGiB = std::uint64_t{1} << 30;
  MemoryBudget budget(resident + kGiB);
  const std::uint64_t share = budget.cache_share(0);
  EXPECT_LT(share, kGiB);
  EXPECT_GT(share, kGiB / 2);
  // What the cache holds itself isn't taken from it; other memory is, entered or not.
  EXPECT_GT(budget.cache_share(resident / 2), share);
  std::vector<char> other(kGiB / 4, 'x');
  EXPECT_LT(budget.cache_share(0), share - kGiB / 5);
  other = {};
  const Reservation entered = budget.reserve(kGiB / 2 + resident, "something");
  EXPECT_LT(budget.cache_share(0), kGiB / 2);
}

TEST(MemoryBudget, HasTheCacheGiveWay) {
  MemoryBudget budget(1000);
  int calls = 0;
  budget.set_cache([&] { ++calls; });
  Reservation a = budget.reserve(10, "a");
  EXPECT_EQ(calls, 1);
  a.resize(5);
  EXPECT_EQ(calls, 1);
  a.resize(20);
  EXPECT_EQ(calls, 2);
  budget.set_cache({});
  a.resize(30);
  EXPECT_EQ(calls, 2);
}

TEST(MemoryBudget, IsThreadSafe) {
  MemoryBudget budget(100);
  std::vector<std::thread> threads;
  for (int n = 0; n < 4; ++n) {
    threads.emplace_back([&] {
      for (int k = 0; k < 5000; ++k) {
        const Reservation r = budget.try_reserve(30, "x");
        EXPECT_LE(budget.used(), 100U);
      }
    });
  }
  for (std::thread& t : threads) {
    t.join();
  }
  EXPECT_EQ(budget.used(), 0U);
}

}  // namespace
}  // namespace rattan
