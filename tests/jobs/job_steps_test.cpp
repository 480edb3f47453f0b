// SPDX-License-Identifier: MIT
#include "jobs/job_steps.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "engine/core/packed_chunk.h"

namespace rattan {
namespace {

namespace fs = std::filesystem;

/// Three steps that build on each other: numbers in the store, and results.
class JobStepsTest : public ::testing::Test {
 protected:
  JobStepsTest() {
    std::string name = (fs::temp_directory_path() / "rattan_steps_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) {
      throw std::runtime_error("no temporary directory");
    }
    base_ = name;
  }
  ~JobStepsTest() override { fs::remove_all(base_); }

  std::unique_ptr<Hdf5Store> open() const {
    return std::make_unique<Hdf5Store>(Hdf5StoreOptions{.directory = base_ / "work", .keep = true});
  }

  /// Runs the first `steps`; which of them were done now.
  std::vector<std::string> run(JobSteps& job, Hdf5Store& store, int first_option, int second_option,
                               int steps = 3) {
    std::vector<std::string> done;
    const auto begun = [&](const char* name) { done.emplace_back(name); };
    job.depend_on("first=" + std::to_string(first_option));
    const int a = job.run("a", [&] {
      begun("a");
      write_packed(store, "a/value", 10 * first_option);
      return first_option;
    });
    EXPECT_EQ(a, first_option);
    if (steps > 1) {
      job.depend_on("second=" + std::to_string(second_option));
      job.run("b", [&] {
        begun("b");
        int before = 0;
        read_packed(store, "a/value", before);
        write_packed(store, "b/value", before + second_option);
        write_packed(store, "b/scratch", 1);
      });
    }
    if (steps > 2) {
      const std::string c = job.run("c", [&] {
        begun("c");
        int before = 0;
        read_packed(store, "b/value", before);
        store.erase("b/scratch");
        write_packed(store, "c/value", 2 * before);
        return std::string("c of ") + std::to_string(before);
      });
      EXPECT_EQ(c, "c of " + std::to_string(10 * first_option + second_option));
      int value = 0;
      read_packed(store, "c/value", value);
      EXPECT_EQ(value, 2 * (10 * first_option + second_option));
    }
    return done;
  }

  using Names = std::vector<std::string>;
  fs::path base_;
};

TEST_F(JobStepsTest, GoesOnWhereItWasSaved) {
  const Names all = {"a", "b", "c"};
  for (int before = 1; before <= 3; ++before) {
    fs::remove_all(base_ / "work");
    {
      const auto store = open();
      JobSteps job(*store, {});
      EXPECT_EQ(run(job, *store, 1, 2, before), Names(all.begin(), all.begin() + before));
      job.save();
      write_packed(*store, "a/value", 99);  // after the save: lost
    }
    const auto store = open();
    JobSteps job(*store, {});
    EXPECT_EQ(run(job, *store, 1, 2), Names(all.begin() + before, all.end()));
    EXPECT_EQ(job.resumed(), static_cast<std::size_t>(before));
  }
}

TEST_F(JobStepsTest, WhatChangedAndAllBehindItIsDoneAgain) {
  {
    const auto store = open();
    JobSteps job(*store, {});
    run(job, *store, 1, 2, 2);
    job.save();
  }
  {
    const auto store = open();
    JobSteps job(*store, {});
    EXPECT_EQ(run(job, *store, 1, 3), (Names{"b", "c"}));
  }
  {
    const auto store = open();  // nothing was saved meanwhile
    JobSteps job(*store, {});
    EXPECT_EQ(run(job, *store, 4, 2), (Names{"a", "b", "c"}));
  }
}

// After "c" the scratch of "b" is gone, so work that goes on behind "b" has to begin before it.
TEST_F(JobStepsTest, AStepWhoseFieldsAreGoneIsDoneAgain) {
  {
    const auto store = open();
    JobSteps job(*store, {});
    run(job, *store, 1, 2);
    job.run("d", [] {});
    job.save();
  }
  const auto store = open();
  JobSteps job(*store, {});
  run(job, *store, 1, 2, 2);
  EXPECT_EQ(job.resumed(), 2U);
  try {
    job.run("other c", [] {});
    ADD_FAILURE() << "it cannot be done";
  } catch (const Rewind& rewind) {
    EXPECT_EQ(rewind.steps, 2U);
  }
  const auto again = open();
  JobSteps rewound(*again, {}, 2);
  EXPECT_EQ(run(rewound, *again, 1, 2, 2), Names{"b"});
}

TEST_F(JobStepsTest, AFileThatIsNoLongerThereIsMadeAgain) {
  const std::string path = (base_ / "made").string();
  const auto make = [&](JobSteps& job) {
    bool made = false;
    job.next_makes(path);
    job.run("make", [&] {
      made = true;
      std::ofstream(path) << "made";
    });
    return made;
  };
  {
    const auto store = open();
    JobSteps job(*store, {});
    EXPECT_TRUE(make(job));
    job.save();
  }
  {
    const auto store = open();
    JobSteps job(*store, {});
    EXPECT_FALSE(make(job));
  }
  std::ofstream(path) << "something else";
  const auto store = open();
  JobSteps job(*store, {});
  EXPECT_TRUE(make(job));
}

TEST_F(JobStepsTest, SavesNothingInADirectoryThatWasTakenOver) {
  {
    const auto store = open();
    JobSteps job(*store, {});
    bool ours = true;
    job.save_only_if([&] { return ours; }, "somewhere/out.work");
    run(job, *store, 1, 2, 1);
    job.save();
    ours = false;
    try {
      job.save();
      ADD_FAILURE() << "it saved";
    } catch (const ResourceError& e) {
      EXPECT_TRUE(std::string(e.what()).starts_with("somewhere/out.work: ")) << e.what();
    }
  }
  const auto store = open();
  JobSteps job(*store, {});
  EXPECT_EQ(run(job, *store, 1, 2), (Names{"b", "c"}));
}

TEST_F(JobStepsTest, ARequestToStopSavesFirst) {
  std::stop_source stop;
  {
    const auto store = open();
    JobSteps job(*store, stop.get_token());
    stop.request_stop();
    EXPECT_THROW(run(job, *store, 1, 2), Cancelled);
  }
  const auto store = open();
  JobSteps job(*store, {});
  EXPECT_EQ(run(job, *store, 1, 2), (Names{"b", "c"}));
}

TEST(CheckpointPolicy, KeepsThePromiseAndThePrice) {
  const CheckpointPolicy policy;
  EXPECT_FALSE(policy.due_before_long_step(3.9, 3.9));
  EXPECT_TRUE(policy.due_before_long_step(2.0, 10.0));
  EXPECT_FALSE(policy.due_before_long_step(0.5, 10.0));
  EXPECT_FALSE(policy.due(3.9, 3.9, 0.0));  // a short run
  EXPECT_TRUE(policy.due(4.2, 4.2, 0.0));
  for (const double elapsed : {10.0, 100.0, 10000.0}) {
    for (const double cost : {0.0, 0.1, 1.0, 1e9}) {
      EXPECT_TRUE(policy.due(5.0 + 0.08 * elapsed, elapsed, cost));
    }
    EXPECT_FALSE(policy.due(4.0, elapsed, 1e9));
  }
}

}  // namespace
}  // namespace rattan
