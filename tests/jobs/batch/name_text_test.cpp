// SPDX-License-Identifier: MIT
#include "jobs/batch/name_text.h"

#include <string>

#include <gtest/gtest.h>

namespace rattan {
namespace {

TEST(NameText, TellsUtf8) {
  for (const char* good : {"", "a", "\xc3\xa9", "\xe2\x82\xac", "\xf0\x9f\x90\xa8", "\xed\x9f\xbf",
                           "\xf4\x8f\xbf\xbf", "a\xc3\xa9z"}) {
    EXPECT_TRUE(is_utf8(good)) << good;
  }
  for (const char* bad :
       {"\xe9", "\xe9z", "\x80", "\xc3", "\xc0\xaf", "\xe0\x80\xaf", "\xed\xa0\x80",
        "\xf0\x80\x80\xaf", "\xf4\x90\x80\x80", "\xf5\x80\x80\x80", "a\xe2\x82"}) {
    EXPECT_FALSE(is_utf8(bad)) << to_hex(bad);
  }
}

TEST(NameText, HexRoundTrip) {
  std::string all;
  for (int c = 0; c < 256; ++c) {
    all += static_cast<char>(c);
  }
  EXPECT_EQ(from_hex(to_hex(all)), all);
  EXPECT_EQ(to_hex("a\xff"), "61ff");
}

}  // namespace
}  // namespace rattan
