// SPDX-License-Identifier: MIT
#include "engine/core/task_graph.h"

#include <atomic>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/errors.h"

namespace rattan {
namespace {

TEST(TaskGraph, CommitsInTileOrderWithBoundedTilesInFlight) {
  TaskGraph graph({.threads = 4, .tiles_in_flight = 3});
  std::atomic<int> in_flight{0};
  std::atomic<int> most{0};
  std::vector<std::uint32_t> order;
  run_pass<int>(
      graph, "pass", 200,
      [&](TileId, int&) {
        const int now = ++in_flight;
        most = std::max(most.load(), now);
      },
      [&](TileId t, int& state) { state = static_cast<int>(t.value) * 2; },
      [&](TileId t, int& state) {
        EXPECT_EQ(state, static_cast<int>(t.value) * 2);
        order.push_back(t.value);
        --in_flight;
      });
  ASSERT_EQ(order.size(), 200U);
  for (std::uint32_t i = 0; i < 200; ++i) {
    EXPECT_EQ(order[i], i);
  }
  EXPECT_LE(most.load(), 3);
  EXPECT_EQ(graph.passes(), 1U);
}

TEST(TaskGraph, RethrowsTheFirstErrorInTileOrder) {
  TaskGraph graph({.threads = 4});
  std::atomic<int> commits{0};
  const auto pass = [&] {
    run_pass<int>(
        graph, "pass", 100, [](TileId, int&) {},
        [](TileId t, int&) {
          if (t.value == 7 || t.value == 50) {
            throw InternalError("tile " + std::to_string(t.value));
          }
        },
        [&](TileId, int&) { ++commits; });
  };
  try {
    pass();
    FAIL() << "nothing was thrown";
  } catch (const InternalError& e) {
    EXPECT_STREQ(e.what(), "tile 7");
  }
  EXPECT_EQ(commits, 7);
}

TEST(TaskGraph, StopsOnRequest) {
  std::stop_source stop;
  TaskGraph graph({.threads = 2}, nullptr, stop.get_token());
  EXPECT_THROW(run_pass<int>(
                   graph, "pass", 1000, [](TileId, int&) {}, [](TileId, int&) {},
                   [&](TileId t, int&) {
                     if (t.value == 3) {
                       stop.request_stop();
                     }
                   }),
               Cancelled);
}

}  // namespace
}  // namespace rattan
