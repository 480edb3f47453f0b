// SPDX-License-Identifier: MIT
#include "jobs/slurm/task_plan.h"

#include <algorithm>
#include <functional>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "jobs/batch/shards.h"

namespace rattan {
namespace {

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;

/// Costs from 1 to 400 s, some tens to hundreds of MiB.
std::vector<TaskScan> mixed(std::size_t count) {
  std::vector<TaskScan> scans(count);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t size = 1 + k * 7919 % 400;
    scans[k] = {static_cast<double>(size), (40 + size / 4) * kMiB, (60 + size) * kMiB};
  }
  return scans;
}

SlurmSite small_site() {
  SlurmSite site;
  site.known = true;
  site.partition = "batch";
  site.nodes = {{3, 4, 4000}};
  return site;
}

std::vector<double> loads(const std::vector<TaskScan>& scans, const TaskArray& array) {
  std::vector<double> sums(array.tasks, 0.0);
  for (std::size_t k = 0; k < array.scans.size(); ++k) {
    sums.at(array.task[k]) += scans[array.scans[k]].cpu_seconds;
  }
  return sums;
}

TEST(TaskPlan, EveryScanIsInOneTask) {
  auto scans = mixed(500);
  scans[3].good_memory = 20000 * kMiB;
  scans[77].good_memory = 3500 * kMiB;
  SlurmSite site = small_site();
  site.nodes.push_back({1, 64, 64000});
  std::vector<std::uint32_t> seen;
  for (const TaskArray& array : plan_tasks(scans, {}, site)) {
    ASSERT_EQ(array.scans.size(), array.task.size());
    EXPECT_TRUE(std::ranges::is_sorted(array.scans));
    EXPECT_LE(array.tasks, array.scans.size());
    seen.insert(seen.end(), array.scans.begin(), array.scans.end());
    for (const double load : loads(scans, array)) {
      EXPECT_GT(load, 0.0);
    }
  }
  std::ranges::sort(seen);
  std::vector<std::uint32_t> all(scans.size());
  std::iota(all.begin(), all.end(), 0U);
  EXPECT_EQ(seen, all);
}

TEST(TaskPlan, TasksAreOfEvenCost) {
  const auto scans = mixed(500);
  TaskWishes wishes;
  wishes.tasks = 12;
  const auto arrays = plan_tasks(scans, wishes, small_site());
  ASSERT_EQ(arrays.size(), 1U);
  const auto sums = loads(scans, arrays[0]);
  ASSERT_EQ(sums.size(), 12U);
  EXPECT_LT(std::ranges::max(sums), 1.02 * std::ranges::min(sums));
  EXPECT_DOUBLE_EQ(arrays[0].longest_seconds, std::ranges::max(sums) / arrays[0].processors);
}

TEST(TaskPlan, TheShardOfATaskHasItsScans) {
  const auto scans = mixed(90);
  for (const TaskArray& array : plan_tasks(scans, {}, small_site())) {
    std::vector<double> costs;
    for (const std::uint32_t scan : array.scans) {
      costs.push_back(scans[scan].cpu_seconds);
    }
    EXPECT_EQ(array.task, pack(costs, array.tasks));
  }
}

TEST(TaskPlan, AHugeScanIsATaskOfItsOwn) {
  auto scans = mixed(20);
  scans[5] = {7200.0, 2000 * kMiB, 9000 * kMiB};
  scans[6] = {7000.0, 2000 * kMiB, 9100 * kMiB};
  scans[7] = {20000.0, 9000 * kMiB, 40000 * kMiB};
  SlurmSite site = small_site();
  site.nodes.push_back({2, 16, 64000});
  const auto arrays = plan_tasks(scans, {}, site);
  ASSERT_EQ(arrays.size(), 3U);
  EXPECT_EQ(arrays[0].name, "large-48G");
  EXPECT_EQ(arrays[0].scans, (std::vector<std::uint32_t>{7}));
  EXPECT_EQ(arrays[1].name, "large-12G");
  EXPECT_EQ(arrays[1].scans, (std::vector<std::uint32_t>{5, 6}));
  EXPECT_EQ(arrays[1].tasks, 2U);
  EXPECT_EQ(arrays[1].processors, 8U);
  EXPECT_NE(arrays[1].task[0], arrays[1].task[1]);
  EXPECT_EQ(arrays[2].name, "scans");
  for (std::size_t k = 0; k < 2; ++k) {
    for (const std::uint32_t scan : arrays[k].scans) {
      EXPECT_GE(memory_inside(arrays[k].mebibytes) * kMiB, scans[scan].good_memory);
    }
  }
}

TEST(TaskPlan, NoNodeIsAskedForMoreThanItHas) {
  auto scans = mixed(20);
  scans[5] = {7200.0, 2000 * kMiB, 9000 * kMiB};
  const auto arrays = plan_tasks(scans, {}, small_site());
  ASSERT_EQ(arrays.size(), 2U);
  for (const TaskArray& array : arrays) {
    EXPECT_TRUE(small_site().has_room_for(array.processors, array.mebibytes));
  }
  EXPECT_EQ(arrays[0].mebibytes, 4000U);  // less than it would like

  TaskWishes wishes;
  wishes.processors = 99;
  EXPECT_THROW(plan_tasks(scans, wishes, small_site()), UsageError);
  wishes = {};
  wishes.mebibytes = 4001;
  EXPECT_THROW(plan_tasks(scans, wishes, small_site()), UsageError);
  wishes.mebibytes = 4000;
  EXPECT_EQ(plan_tasks(scans, wishes, small_site()).back().mebibytes, 4000U);
}

TEST(TaskPlan, MemoryIsEnoughForTheLargestScansSideBySide) {
  const auto scans = mixed(50);
  const auto arrays = plan_tasks(scans, {}, SlurmSite());
  ASSERT_EQ(arrays.size(), 1U);
  std::vector<std::uint64_t> needs;
  for (const TaskScan& scan : scans) {
    needs.push_back(scan.good_memory / kMiB);
  }
  std::ranges::sort(needs, std::greater());
  const auto four = std::accumulate(needs.begin(), needs.begin() + 4, std::uint64_t{0});
  EXPECT_GE(memory_inside(arrays[0].mebibytes), four);
  EXPECT_LE(arrays[0].mebibytes, 2 * four);
}

TEST(TaskPlan, TheNumberOfTasksFollowsTheWorkAndTheSite) {
  EXPECT_TRUE(plan_tasks({}, {}, small_site()).empty());
  const auto tasks = [](std::size_t count, double seconds, const SlurmSite& site) {
    const std::vector<TaskScan> scans(count, {seconds, 50 * kMiB, 60 * kMiB});
    return plan_tasks(scans, {}, site).at(0).tasks;
  };
  EXPECT_EQ(tasks(100, 0.5, small_site()), 1U);      // not worth a second start
  EXPECT_EQ(tasks(1, 100000.0, small_site()), 1U);   // a scan can't be shared
  EXPECT_EQ(tasks(1000, 400.0, small_site()), 56U);  // half an hour each on four processors
  EXPECT_EQ(tasks(1000, 40.0, small_site()), 16U);   // shorter, so that all nodes have some
  SlurmSite tight = small_site();
  tight.most_tasks = 7;
  EXPECT_EQ(tasks(100000, 400.0, tight), 7U);
}

TEST(TaskPlan, TimeHasSlackAndTheLimitOfThePartition) {
  const std::vector<TaskScan> scans(10, {3600.0, 50 * kMiB, 60 * kMiB});
  TaskWishes wishes;
  wishes.tasks = 1;
  EXPECT_EQ(plan_tasks(scans, wishes, small_site())[0].minutes, 610U);
  SlurmSite site = small_site();
  site.most_minutes = 60;
  EXPECT_EQ(plan_tasks(scans, wishes, site)[0].minutes, 60U);
  wishes.minutes = 1;
  EXPECT_EQ(plan_tasks(scans, wishes, site)[0].minutes, 1U);
}

TEST(TaskPlan, ArraysWithinTheLimit) {
  EXPECT_EQ(array_sizes(12, 1000), (std::vector<std::uint32_t>{12}));
  EXPECT_EQ(array_sizes(1000, 1000), (std::vector<std::uint32_t>{1000}));
  EXPECT_EQ(array_sizes(1001, 1000), (std::vector<std::uint32_t>{501, 500}));
  for (const std::uint32_t tasks : {1U, 7U, 100U, 2999U}) {
    const auto sizes = array_sizes(tasks, 10);
    EXPECT_EQ(std::accumulate(sizes.begin(), sizes.end(), 0U), tasks);
    EXPECT_LE(std::ranges::max(sizes), 10U);
  }
}

TEST(TaskPlan, TheWarningLeavesMostOfAShortLimit) {
  EXPECT_EQ(warning_seconds(1), 15U);
  EXPECT_EQ(warning_seconds(10), 60U);
  EXPECT_EQ(warning_seconds(10000), 60U);
}

}  // namespace
}  // namespace rattan
