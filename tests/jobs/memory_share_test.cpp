// SPDX-License-Identifier: MIT
#include "jobs/memory_share.h"

#include <filesystem>
#include <fstream>
#include <map>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace rattan {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;

class MemoryShare : public testing::Test {
 protected:
  void SetUp() override {
    root_ = fs::path(testing::TempDir()) /
            testing::UnitTest::GetInstance()->current_test_info()->name();
    fs::remove_all(root_);
    put("proc/meminfo", "MemTotal: 16777216 kB\nMemFree: 1 kB\nMemAvailable: 8388608 kB\n");
  }
  void TearDown() override { fs::remove_all(root_); }

  void put(const std::string& path, const std::string& text) {
    fs::create_directories((root_ / path).parent_path());
    std::ofstream(root_ / path) << text;
  }
  std::uint64_t granted() {
    return granted_memory({root_.string(), [this](const char* name) -> const char* {
                             const auto at = environment_.find(name);
                             return at == environment_.end() ? nullptr : at->second.c_str();
                           }});
  }

  fs::path root_;
  std::map<std::string, std::string> environment_;
};

TEST_F(MemoryShare, IsWhatTheMachineHasFree) {
  EXPECT_EQ(granted(), 8192 * kMiB);
}

TEST_F(MemoryShare, HeedsEveryGroupAbove) {
  put("proc/self/cgroup", "0::/job/step\n");
  put("sys/fs/cgroup/job/step/memory.max", "max\n");
  put("sys/fs/cgroup/job/memory.max", std::to_string(3000 * kMiB));
  put("sys/fs/cgroup/job/memory.current", std::to_string(1000 * kMiB));
  put("sys/fs/cgroup/job/memory.stat", fmt::format("anon 1\nfile {}\nslab 7\n", 400 * kMiB));
  EXPECT_EQ(granted(), 2400 * kMiB);
  put("sys/fs/cgroup/job/step/memory.max", std::to_string(500 * kMiB));
  EXPECT_EQ(granted(), 500 * kMiB);
}

TEST_F(MemoryShare, HeedsGroupsOfTheFirstVersion) {
  put("proc/self/cgroup", "11:cpu,cpuacct:/x\n7:memory:/slurm/job\n0::/\n");
  put("sys/fs/cgroup/memory/slurm/job/memory.limit_in_bytes", std::to_string(700 * kMiB));
  put("sys/fs/cgroup/memory/slurm/job/memory.usage_in_bytes", std::to_string(100 * kMiB));
  EXPECT_EQ(granted(), 600 * kMiB);
}

TEST_F(MemoryShare, HeedsSlurm) {
  environment_["SLURM_MEM_PER_CPU"] = "512";
  environment_["SLURM_CPUS_ON_NODE"] = std::to_string(4);
  EXPECT_EQ(granted(), 2048 * kMiB);
  environment_["SLURM_MEM_PER_NODE"] = "1000";
  EXPECT_EQ(granted(), 1000 * kMiB);
  environment_["SLURM_MEM_PER_NODE"] = std::to_string(0);  // all of the node's
  environment_.erase("SLURM_MEM_PER_CPU");
  EXPECT_EQ(granted(), 8192 * kMiB);
}

TEST_F(MemoryShare, IsNeverLessThanAProgramNeeds) {
  EXPECT_GE(default_memory_share(), 256 * kMiB);
}

}  // namespace
}  // namespace rattan
