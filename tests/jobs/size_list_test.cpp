// SPDX-License-Identifier: MIT
#include "jobs/size_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/core/errors.h"

namespace rattan {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(SizeList, NumbersAndSuffixes) {
  EXPECT_THAT(parse_sizes("50k,10k,2k", "--faces", {1, 1e10}), ElementsAre(50000, 10000, 2000));
  EXPECT_THAT(parse_sizes("1.5M", "--faces", {1, 1e10}), ElementsAre(1500000));
  EXPECT_THAT(parse_sizes("0.05,1e-3", "--ratio", {1e-9, 10}), ElementsAre(0.05, 0.001));
}

TEST(SizeList, WhatIsNoSizeIsNamed) {
  for (const char* text : {"", ",", "5,", "many", "5K", "5 k", "k", "0x10", "nan", "inf", "1k2",
                           "-5", "0", "1e11", "5,1e11"}) {
    SCOPED_TRACE(text);
    try {
      parse_sizes(text, "--faces", {1, 1e10});
      FAIL() << "no error";
    } catch (const UsageError& e) {
      EXPECT_THAT(e.what(), HasSubstr("--faces: "));
    }
  }
}

TEST(SizeList, TextIsShortAndReadsBack) {
  EXPECT_EQ(size_text(50000), "50000");
  EXPECT_EQ(size_text(0.05), "0.05");
  EXPECT_EQ(size_text(1e10), "10000000000");
  for (const double size : {1e-30, 1.0 / 3.0, 123456.789, 1e30}) {
    EXPECT_THAT(parse_sizes(size_text(size), "--edge-length", {1e-30, 1e30}), ElementsAre(size));
  }
}

}  // namespace
}  // namespace rattan
