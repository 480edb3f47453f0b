// SPDX-License-Identifier: MIT
#include "jobs/slurm/submission.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "jobs/batch/item_states.h"
#include "jobs/batch/journal.h"
#include "jobs/batch/manifest.h"
#include "jobs/batch/shards.h"

namespace rattan {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A directory with some scans, and a Slurm that knows what `queue` says.
class SubmissionFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = fs::temp_directory_path() / "rattan-test.XXXXXX";
    root_ = ::mkdtemp(name.data());
    request_.directory = (root_ / "out").string();
    request_.script.program = "/opt/rattan";
    request_.command = "rattan slurm scans -o out";
    fs::create_directories(request_.directory);
    for (int k = 0; k < 12; ++k) {
      items_.push_back(item(fmt::format("scan{:02}.drc", k), options_));
      items_.back().cost = 100.0 + k;
    }
  }
  void TearDown() override { fs::remove_all(root_); }

  BatchItem item(const std::string& id, const std::shared_ptr<const ItemOptions>& options) {
    BatchItem made;
    made.id = id;
    made.scan = (root_ / (id + ".ply")).string();
    made.what = options;
    return made;
  }

  static std::shared_ptr<const ItemOptions> options_of(const std::string& key) {
    auto options = std::make_shared<ItemOptions>();
    options->key = key;
    return options;
  }

  void journal(const BatchItem& scan, int exit) {
    JournalWriter writer(request_.directory);
    StartRecord start;
    start.id = scan.id;
    start.scan = scan.scan;
    start.key = scan.what->key;
    start.attempt = ++attempts_[scan.id];
    start.rattan = rattan_identity();
    writer.append(start);
    EndRecord end;
    end.id = scan.id;
    end.attempt = start.attempt;
    end.exit = exit;
    if (exit == 0) {
      std::ofstream(fs::path(request_.directory) / scan.id) << "mesh";
      end.outputs = {{scan.id, 4}};
    }
    writer.append(end);
  }

  CommandOutput slurm(const std::vector<std::string>& words) {
    CommandOutput answer;
    if (words[0] == "squeue") {
      const std::string id = words.back().substr(words.back().find('=') + 1);
      const auto at = queue_.find(id);
      answer.code = at == queue_.end() ? 1 : 0;
      if (at == queue_.end()) {
        answer.error = "slurm_load_jobs error: Invalid job id specified\n";
      } else {
        for (const int task : at->second) {
          answer.out += std::to_string(task) + '\n';
        }
      }
    }
    return answer;
  }
  CommandRunner runner() {
    return [this](const std::vector<std::string>& words) { return slurm(words); };
  }

  Submission prepare() { return prepare_submission(items_, request_, SlurmSite(), runner()); }

  /// As submit.sh would.
  static void submitted(const Submission& submission, const std::string& lines) {
    std::ofstream(fs::path(submission.folder) / "jobs") << lines;
  }

  fs::path root_;
  std::vector<BatchItem> items_;
  std::shared_ptr<const ItemOptions> options_ = options_of("ratio=0.05");
  SubmissionRequest request_;
  std::map<std::string, std::vector<int>> queue_;
  std::map<std::string, int> attempts_;
};

TEST_F(SubmissionFiles, WritesScriptsAndManifests) {
  request_.wishes.tasks = 4;
  request_.retry_failed = true;
  const Submission submission = prepare();
  EXPECT_EQ(submission.to_do, 12U);
  EXPECT_EQ(submission.folder, request_.directory + "/.rattan/slurm/1");
  ASSERT_EQ(submission.arrays.size(), 1U);
  EXPECT_EQ(submission.arrays[0].tasks, 4U);
  for (const char* name : {"scans.sh", "scans.jsonl", "merge.sh", "submit.sh", "plan.json"}) {
    EXPECT_TRUE(fs::exists(fs::path(submission.folder) / name)) << name;
  }
  EXPECT_TRUE(fs::exists(slurm_manifest(request_.directory)));
  EXPECT_TRUE(fs::is_directory(request_.directory + "/.rattan/slurm/logs"));
  std::ifstream stream(fs::path(submission.folder) / "scans.sh");
  const std::string script{std::istreambuf_iterator<char>(stream), {}};
  EXPECT_THAT(script, HasSubstr("\"$shard/$tasks\" --retry-failed"));

  Journal read(request_.directory);
  read.refresh();
  ASSERT_EQ(read.batches().size(), 1U);
  EXPECT_EQ(read.batches()[0].action, "submit");
  EXPECT_EQ(read.batches()[0].total, 12U);
  EXPECT_GT(read.batches()[0].time, 1.7e9);
}

TEST_F(SubmissionFiles, TheManifestTellsEachTaskItsShareOfTheCost) {
  request_.wishes.tasks = 4;
  const Submission submission = prepare();
  std::vector<double> costs;
  read_manifest(submission.folder + "/scans.jsonl", {},
                [&](ManifestRow&& row) { costs.push_back(row.cost); });
  ASSERT_EQ(costs.size(), 12U);
  EXPECT_EQ(pack(costs, 4), submission.arrays[0].task);
}

TEST_F(SubmissionFiles, OnlyWhatIsMissingIsSubmitted) {
  journal(items_[3], 0);
  journal(items_[4], 3);
  journal(items_[5], 75);
  journal(items_[6], 4);
  const Submission submission = prepare();
  EXPECT_EQ(submission.done, 1U);
  EXPECT_EQ(submission.failed, 1U);
  EXPECT_EQ(submission.to_do, 10U);

  for (const BatchItem& scan : items_) {
    if (scan.id != items_[4].id) {
      journal(scan, 0);
    }
  }
  const Submission nothing = prepare();
  EXPECT_EQ(nothing.done, 11U);
  EXPECT_EQ(nothing.to_do, 0U);
  EXPECT_EQ(nothing.folder, "");
  EXPECT_FALSE(fs::exists(request_.directory + "/.rattan/slurm/2"));
}

TEST_F(SubmissionFiles, ScansOfLiveTasksAreInHand) {
  request_.wishes.tasks = 4;
  const Submission first = prepare();
  submitted(first, "scans 0 40\nmerge 0 41\n");
  queue_ = {{"40", {2, 4}}, {"41", {1}}};

  const Submission second = prepare();
  EXPECT_EQ(second.in_hand, 6U);
  EXPECT_EQ(second.to_do, 6U);
  EXPECT_EQ(second.folder, request_.directory + "/.rattan/slurm/2");
  std::set<std::string> again;
  read_manifest(second.folder + "/scans.jsonl", {},
                [&](ManifestRow&& row) { again.insert(row.output); });
  for (std::size_t k = 0; k < items_.size(); ++k) {
    const std::uint32_t task = first.arrays[0].task[k] + 1;
    EXPECT_EQ(again.contains(items_[k].id), task == 1 || task == 3) << k;
  }
  std::ifstream stream(fs::path(second.folder) / "submit.sh");
  const std::string script{std::istreambuf_iterator<char>(stream), {}};
  EXPECT_THAT(script, HasSubstr("after=$after:40"));  // the new merge waits for them, too

  queue_.clear();  // Slurm has forgotten the job
  EXPECT_THAT(read_scans_in_hand(request_.directory, runner()).by_id, IsEmpty());
}

TEST_F(SubmissionFiles, TasksOfASecondArrayCountOn) {
  request_.wishes.tasks = 4;
  const Submission first = prepare();
  submitted(first, "scans 0 40\nscans 2 41\nmerge 0 42\n");
  queue_ = {{"40", {}}, {"41", {1}}};
  const ScansInHand hands = read_scans_in_hand(request_.directory, runner());
  EXPECT_THAT(hands.jobs, ElementsAre("41"));
  EXPECT_EQ(hands.by_id.size(), 3U);
  for (std::size_t k = 0; k < items_.size(); ++k) {
    EXPECT_EQ(hands.by_id.contains(items_[k].id), first.arrays[0].task[k] == 2) << k;
  }
  EXPECT_EQ(hands.by_id.begin()->second.task, "41_1");
}

TEST_F(SubmissionFiles, OtherOptionsWaitForTheTasksThatHaveTheOld) {
  submitted(prepare(), "scans 0 40\nmerge 0 41\n");
  queue_ = {{"40", {1}}};
  for (BatchItem& scan : items_) {
    scan.what = options_of("ratio=0.1");
  }
  try {
    prepare();
    FAIL();
  } catch (const UsageError& e) {
    EXPECT_THAT(e.what(), HasSubstr("scancel 40"));
  }
  queue_.clear();
  EXPECT_EQ(prepare().to_do, 12U);
}

TEST_F(SubmissionFiles, ASilentSlurmIsNoReasonToSubmitTwice) {
  submitted(prepare(), "scans 0 40\nmerge 0 41\n");
  const CommandRunner down = [](const auto&) {
    return CommandOutput{1, "", "slurm_load_jobs error: Unable to contact slurm controller\n"};
  };
  EXPECT_THROW(prepare_submission(items_, request_, SlurmSite(), down), ResourceError);
}

TEST_F(SubmissionFiles, TheCheckNamesWhatIsMissingAndHowToGoOn) {
  request_.wishes.tasks = 1;
  submitted(prepare(), "scans 0 40\nmerge 0 41\n");
  for (std::size_t k = 0; k < 10; ++k) {
    journal(items_[k], k == 5 ? 3 : 0);
  }
  const MissingScans missing = find_missing(items_, request_.directory, runner());
  EXPECT_EQ(missing.command, request_.command);
  EXPECT_THAT(missing.scans, ElementsAre(std::pair(items_[10].id, Standing::kNew),
                                         std::pair(items_[11].id, Standing::kNew)));
  queue_ = {{"40", {1}}};
  const MissingScans later = find_missing(items_, request_.directory, runner());
  EXPECT_EQ(later.in_hand, 2U);
  EXPECT_THAT(later.scans, IsEmpty());
}

TEST_F(SubmissionFiles, WhatSlurmSaysIsPassedOn) {
  const Submission submission = prepare();
  try {
    submit(submission.folder, [](const auto&) {
      return CommandOutput{1, "", "sbatch: error: invalid account\n"};
    });
    FAIL();
  } catch (const ResourceError& e) {
    EXPECT_THAT(e.what(), HasSubstr("invalid account"));
  }
}

TEST_F(SubmissionFiles, AFolderThatSlurmCantWriteLogsTo) {
  request_.directory += "\\";
  EXPECT_THROW(prepare(), UsageError);
}

}  // namespace
}  // namespace rattan
