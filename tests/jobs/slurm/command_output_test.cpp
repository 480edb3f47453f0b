// SPDX-License-Identifier: MIT
#include "jobs/slurm/command_output.h"

#include <string>

#include <gtest/gtest.h>

namespace rattan {
namespace {

TEST(CommandOutput, KeepsBothStreamsAndTheCode) {
  const CommandOutput got = run_command({"sh", "-c", "echo one; echo two >&2; exit 3"});
  EXPECT_EQ(got.code, 3);
  EXPECT_EQ(got.out, "one\n");
  EXPECT_EQ(got.error, "two\n");
}

TEST(CommandOutput, WordsReachTheProgramAsTheyAre) {
  const std::string odd = "a b'\"$HOME\n*";
  EXPECT_EQ(run_command({"printf", "%s|", odd, ""}).out, odd + "||");
}

TEST(CommandOutput, MoreThanAPipeHolds) {
  const CommandOutput got =
      run_command({"sh", "-c", "yes 1234567 | head -c 400000 >&2; yes 1234567 | head -c 300000"});
  EXPECT_EQ(got.error.size(), 400000U);
  EXPECT_EQ(got.out.size(), 300000U);
}

TEST(CommandOutput, SignalsAndMissingPrograms) {
  EXPECT_EQ(run_command({"sh", "-c", "kill -KILL $$"}).code, 128 + 9);
  EXPECT_EQ(run_command({"no-program-has-this-name"}).code, 127);
}

}  // namespace
}  // namespace rattan
