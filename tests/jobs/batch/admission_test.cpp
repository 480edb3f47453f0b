// SPDX-License-Identifier: MIT
#include "jobs/batch/admission.h"

#include <algorithm>
#include <map>
#include <queue>
#include <random>

#include <gtest/gtest.h>

#include "jobs/remesh_cost.h"

namespace rattan {
namespace {

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;

Admission::Task task(double cpu, std::uint64_t least_mib, std::uint64_t good_mib) {
  Admission::Task t;
  t.forecast.cpu_seconds = cpu;
  t.forecast.least_memory = least_mib * kMiB;
  t.forecast.good_memory = good_mib * kMiB;
  return t;
}

struct Event {
  double time;
  std::size_t task;
  bool operator>(const Event& other) const {
    return time != other.time ? time > other.time : task > other.task;
  }
};

struct Outcome {
  double wall = 0.0;
  double busy = 0.0;  ///< thread seconds
  std::map<std::size_t, Admission::Grant> grants;
  std::map<std::size_t, double> starts;
  std::vector<std::size_t> order;
};

/// Runs all in simulated time, where things take `error` times what was foreseen, and checks the
/// limits all along.
Outcome simulate(const Admission::Limits& limits, std::vector<Admission::Task> tasks,
                 double error = 1.0) {
  Admission admission(limits);
  const std::vector<Admission::Task> copy = tasks;
  admission.set_tasks(std::move(tasks));
  Outcome out;
  std::priority_queue<Event, std::vector<Event>, std::greater<>> events;
  double now = 0.0;
  std::mt19937 random(7);
  for (;;) {
    while (auto g = admission.next(now)) {
      EXPECT_GE(g->threads, 1);
      EXPECT_LE(admission.threads_used(), limits.threads);
      EXPECT_LE(admission.memory_used(), limits.memory);
      if (limits.jobs > 0) {
        EXPECT_LE(admission.running(), static_cast<std::size_t>(limits.jobs));
      }
      if (admission.possible(g->task)) {
        EXPECT_GE(g->memory, copy[g->task].forecast.least_memory);
      }
      EXPECT_TRUE(out.grants.emplace(g->task, *g).second) << "granted twice";
      out.starts[g->task] = now;
      out.order.push_back(g->task);
      const double noise =
          error == 1.0 ? 1.0 : std::uniform_real_distribution<>(1.0 / error, error)(random);
      const double seconds = noise * forecast_seconds(copy[g->task].forecast, g->threads);
      out.busy += seconds * g->threads;
      events.push({now + seconds, g->task});
    }
    if (events.empty()) {
      break;
    }
    now = events.top().time;
    admission.ended(events.top().task);
    events.pop();
  }
  EXPECT_EQ(out.grants.size(), copy.size());
  EXPECT_EQ(admission.waiting(), 0U);
  out.wall = now;
  return out;
}

TEST(Admission, RunsScansSideBySideOnOneThreadEach) {
  std::vector<Admission::Task> tasks(64, task(0.5, 60, 90));
  const Outcome out = simulate({.threads = 2, .memory = 4000 * kMiB}, tasks);
  std::size_t single = 0;
  for (const auto& [i, grant] : out.grants) {
    single += grant.threads == 1 ? 1 : 0;
  }
  EXPECT_GE(single, 63U);
  EXPECT_NEAR(out.wall, 16.0, 0.6);
}

TEST(Admission, KeepsAMixedBatchBusy) {
  std::mt19937 random(1);
  std::vector<Admission::Task> tasks;
  for (int i = 0; i < 200; ++i) {
    const double triangles = 1e4 * std::pow(200.0, std::uniform_real_distribution<>(0, 1)(random));
    tasks.push_back(task(remesh_cpu_seconds(triangles, 0.05 * triangles, 1.0),
                         60 + static_cast<std::uint64_t>(triangles / 1e4),
                         60 + static_cast<std::uint64_t>(triangles / 1e3)));
  }
  for (const int threads : {2, 4, 16}) {
    const Outcome out = simulate({.threads = threads, .memory = 20000 * kMiB}, tasks, 1.3);
    EXPECT_GT(out.busy / (out.wall * threads), 0.95) << threads;
  }
}

TEST(Admission, StartsWithTheLargest) {
  const Outcome out =
      simulate({.threads = 1, .memory = 1000 * kMiB},
               {task(1, 60, 90), task(5, 60, 90), task(3, 60, 90), task(5, 60, 90)});
  EXPECT_EQ(out.order, (std::vector<std::size_t>{1, 3, 2, 0}));
}

TEST(Admission, GivesAHugeScanEverything) {
  std::vector<Admission::Task> tasks(10, task(1.0, 60, 90));
  tasks.push_back(task(500.0, 600, 3000));
  const Outcome out = simulate({.threads = 8, .memory = 4000 * kMiB}, tasks);
  EXPECT_EQ(out.order[0], 10U);
  EXPECT_EQ(out.grants.at(10).threads, 8);
  EXPECT_EQ(out.grants.at(10).memory, 4000 * kMiB);
}

TEST(Admission, GivesALargeScanItsShareOfThreads) {
  std::vector<Admission::Task> tasks(60, task(1.0, 60, 90));
  tasks.push_back(task(20.0, 60, 90));  // a quarter of all
  const Outcome out = simulate({.threads = 8, .memory = 8000 * kMiB}, tasks);
  EXPECT_EQ(out.grants.at(60).threads, 2);
}

TEST(Admission, OneScanAloneGetsAllThreads) {
  EXPECT_EQ(simulate({.threads = 4, .memory = 900 * kMiB}, {task(1, 60, 90)}).grants.at(0).threads,
            4);
}

TEST(Admission, ThreadsThatMemoryLeavesIdleGoToThoseThatRun) {
  // Two at once fit, on eight threads.
  const Outcome out = simulate({.threads = 8, .memory = 2100 * kMiB},
                               std::vector<Admission::Task>(20, task(10, 1000, 1200)));
  EXPECT_GE(out.grants.at(0).threads, 4);
}

TEST(Admission, KeepsToTheNumberOfJobs) {
  const Outcome out = simulate({.threads = 8, .memory = 8000 * kMiB, .jobs = 2},
                               std::vector<Admission::Task>(20, task(10, 60, 90)));
  EXPECT_EQ(out.grants.at(0).threads, 4);
}

TEST(Admission, DividesMemoryBetweenNeedAndUse) {
  const Outcome rich = simulate({.threads = 2, .memory = 64000 * kMiB},
                                std::vector<Admission::Task>(20, task(10, 60, 100)));
  EXPECT_GE(rich.grants.at(0).memory, 100 * kMiB);
  EXPECT_LE(rich.grants.at(0).memory, 200 * kMiB);
  const Outcome poor = simulate({.threads = 2, .memory = 160 * kMiB},
                                std::vector<Admission::Task>(20, task(10, 60, 100)));
  EXPECT_EQ(poor.grants.at(0).memory, 80 * kMiB);
}

TEST(Admission, ASmallScanDoesNotHoldUpOneThatNeedsMuchMemory) {
  // The large ones need nearly all memory; a stream of small ones must not starve the second.
  std::vector<Admission::Task> tasks(100, task(1.0, 60, 90));
  tasks.push_back(task(30.0, 900, 950));
  tasks.push_back(task(29.0, 900, 950));
  const Outcome out = simulate({.threads = 2, .memory = 1000 * kMiB}, tasks);
  const double first_end = forecast_seconds(tasks[100].forecast, out.grants.at(100).threads);
  EXPECT_LE(out.starts.at(101), first_end + 1.5);
}

TEST(Admission, NothingIsLostUnderAnyLimits) {
  std::mt19937 random(3);
  for (int round = 0; round < 60; ++round) {
    const auto pick = [&](int a, int b) { return std::uniform_int_distribution<>(a, b)(random); };
    std::vector<Admission::Task> tasks;
    const int n = pick(1, 60);
    for (int i = 0; i < n; ++i) {
      const auto least = static_cast<std::uint64_t>(pick(40, 1500));
      tasks.push_back(
          task(pick(1, 1000) * 0.1, least, least + static_cast<std::uint64_t>(pick(0, 2000))));
      if (pick(0, 9) == 0) {
        tasks.back().threads = pick(1, 12);
      }
      if (pick(0, 9) == 0) {
        tasks.back().memory = tasks.back().forecast.least_memory + 10 * kMiB;
      }
    }
    simulate({.threads = pick(1, 9),
              .memory = static_cast<std::uint64_t>(pick(100, 3000)) * kMiB,
              .jobs = pick(0, 4)},
             tasks, 2.0);
  }
}

TEST(Admission, WhatIsPutBackComesLastAndAloneIfAskedTo) {
  Admission admission({.threads = 4, .memory = 1000 * kMiB});
  admission.set_tasks({task(4, 60, 90), task(1, 60, 90), task(1, 60, 90), task(1, 60, 90)});
  auto first = admission.next(0.0);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->task, 0U);
  admission.put_back(0, true);
  std::vector<std::size_t> others;
  while (auto g = admission.next(0.1)) {
    EXPECT_NE(g->task, 0U);
    others.push_back(g->task);
  }
  EXPECT_EQ(others.size(), 3U);
  for (const std::size_t t : others) {
    EXPECT_FALSE(admission.next(1.0));
    admission.ended(t);
  }
  auto again = admission.next(2.0);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->task, 0U);
  EXPECT_EQ(again->memory, 1000 * kMiB);
  EXPECT_EQ(again->threads, 4);
  EXPECT_EQ(admission.waiting(), 0U);
}

}  // namespace
}  // namespace rattan
