// SPDX-License-Identifier: MIT
#include "jobs/slurm/slurm_site.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/core/errors.h"

namespace rattan {
namespace {

// As Slurm 22.05 prints it, shortened.
constexpr const char* kConfig =
    "Configuration data as of 2026-11-22T17:08:03\n"
    "AccountingStorageBackupHost = (null)\n"
    "MaxArraySize            = 501\n"
    "MaxJobCount             = 10000\n";
constexpr const char* kPartitions =
    "PartitionName=batch AllowGroups=ALL Default=YES DefaultTime=NONE MaxNodes=UNLIMITED "
    "MaxTime=UNLIMITED MaxMemPerNode=UNLIMITED Nodes=n[1-3]\n"
    "PartitionName=short AllowGroups=ALL Default=NO DefaultTime=00:10:00 MaxNodes=UNLIMITED "
    "MaxTime=1-02:00:00 MaxMemPerNode=3000 Nodes=n[1-3]\n";

CommandOutput answer(const std::vector<std::string>& words) {
  CommandOutput output;
  output.code = 0;
  if (words[0] == "sinfo") {
    output.out = "3 4 4000\n1 64 250000\n";
  } else {
    output.out = words.back() == "config" ? kConfig : kPartitions;
  }
  return output;
}

TEST(SlurmSite, IsReadFromItsCommands) {
  const SlurmSite site = read_slurm_site(answer, "");
  EXPECT_TRUE(site.known);
  EXPECT_EQ(site.partition, "batch");
  EXPECT_EQ(site.most_tasks, 500U);  // the largest index is MaxArraySize - 1
  EXPECT_FALSE(site.most_minutes);
  EXPECT_FALSE(site.most_mebibytes);
  EXPECT_EQ(site.processors(), 76U);
  EXPECT_EQ(site.most_processors(), 64U);
  EXPECT_EQ(site.most_memory(), 250000U);
  EXPECT_TRUE(site.has_room_for(64, 250000));
  EXPECT_FALSE(site.has_room_for(65, 1));
}

TEST(SlurmSite, APartitionHasLimitsOfItsOwn) {
  std::vector<std::string> asked;
  const SlurmSite site = read_slurm_site(
      [&](const std::vector<std::string>& words) {
        if (words[0] == "sinfo") {
          asked = words;
        }
        return answer(words);
      },
      "short");
  EXPECT_EQ(site.most_minutes, 26U * 60U);
  EXPECT_EQ(site.most_memory(), 3000U);
  EXPECT_FALSE(site.has_room_for(1, 3001));
  EXPECT_THAT(asked, ::testing::Contains("--partition=short"));
}

TEST(SlurmSite, AWrongPartitionIsNamedWithTheRightOnes) {
  try {
    read_slurm_site(answer, "shrot");
    FAIL();
  } catch (const UsageError& e) {
    EXPECT_STREQ(e.what(), "There is no partition shrot here; there are batch, short.");
  }
}

TEST(SlurmSite, WithoutSlurmItsDefaultsHold) {
  const SlurmSite site = read_slurm_site([](const auto&) { return CommandOutput{}; }, "any");
  EXPECT_FALSE(site.known);
  EXPECT_EQ(site.partition, "any");
  EXPECT_EQ(site.most_tasks, 1000U);
  EXPECT_TRUE(site.has_room_for(1000, 1'000'000));
}

TEST(SlurmSite, Times) {
  EXPECT_EQ(parse_slurm_time("90"), 90U);
  EXPECT_EQ(parse_slurm_time("1:30"), 2U);
  EXPECT_EQ(parse_slurm_time("02:00:00"), 120U);
  EXPECT_EQ(parse_slurm_time("1-12"), 36U * 60U);
  EXPECT_EQ(parse_slurm_time("1-12:30"), 36U * 60U + 30U);
  EXPECT_EQ(parse_slurm_time("7-00:00:01"), 7U * 1440U + 1U);
  for (const char* none :
       {"", "UNLIMITED", "INFINITE", "NONE", "1:2:3:4", "-5", "1h", "1-", "a:b"}) {
    EXPECT_FALSE(parse_slurm_time(none)) << none;
  }
  EXPECT_EQ(slurm_time(1), "00:01:00");
  EXPECT_EQ(slurm_time(1439), "23:59:00");
  EXPECT_EQ(slurm_time(3000), "2-02:00:00");
  for (const std::uint64_t minutes : {1U, 59U, 60U, 1439U, 1440U, 99999U}) {
    EXPECT_EQ(parse_slurm_time(slurm_time(minutes)), minutes);
  }
}

TEST(SlurmSite, Memory) {
  EXPECT_EQ(parse_slurm_memory("4000"), 4000U);
  EXPECT_EQ(parse_slurm_memory("4000M"), 4000U);
  EXPECT_EQ(parse_slurm_memory("2G"), 2048U);
  EXPECT_EQ(parse_slurm_memory("1.5GiB"), 1536U);
  EXPECT_EQ(parse_slurm_memory("1T"), 1048576U);
  EXPECT_EQ(parse_slurm_memory("1500k"), 2U);
  EXPECT_EQ(parse_slurm_memory("0"), 0U);
  for (const char* wrong : {"", "G", "-1G", "4X", "4 G", "nan", "inf"}) {
    EXPECT_THROW(parse_slurm_memory(wrong), UsageError) << wrong;
  }
}

}  // namespace
}  // namespace rattan
