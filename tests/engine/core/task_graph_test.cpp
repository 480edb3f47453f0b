// SPDX-License-Identifier: MIT
#include "engine/core/task_graph.h"

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "engine/core/disk_reads.h"
#include "engine/core/errors.h"

namespace rattan {
namespace {

/// Loading by the workers, and on a thread of its own.
class TaskGraphPass : public ::testing::TestWithParam<bool> {
 protected:
  TaskGraphPass() {
    TaskGraph graph;  // nothing from before counts
    run_pass<int>(
        graph, "before", 10, [](TileId, int&) {}, [](TileId, int&) {}, [](TileId, int&) {});
    if (GetParam()) {
      note_disk_read();
    }
  }
};
INSTANTIATE_TEST_SUITE_P(Loading, TaskGraphPass, ::testing::Bool());

TEST_P(TaskGraphPass, CommitsInTileOrderWithBoundedTilesInFlight) {
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

TEST_P(TaskGraphPass, RethrowsTheFirstErrorInTileOrder) {
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

TEST_P(TaskGraphPass, StopsOnRequest) {
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

// With one thread: loading goes on while a tile is computed.
TEST(TaskGraph, LoadsBesideTheWorkerWhereChunksComeFromADisk) {
  const oneapi::tbb::global_control one(oneapi::tbb::global_control::max_allowed_parallelism, 1);
  note_disk_read();
  TaskGraph graph({.threads = 1, .tiles_in_flight = 4});
  std::atomic<int> loaded{0};
  std::atomic<int> ahead{0};
  run_pass<int>(
      graph, "pass", 20, [&](TileId, int&) { ++loaded; },
      [&](TileId t, int&) {
        const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
        while (t.value == 0 && loaded < 4 && std::chrono::steady_clock::now() < end) {
          std::this_thread::yield();
        }
        ahead = t.value == 0 ? loaded.load() : ahead.load();
      },
      [](TileId, int&) {});
  EXPECT_EQ(ahead, 4);
  EXPECT_EQ(loaded, 20);
}

}  // namespace
}  // namespace rattan
