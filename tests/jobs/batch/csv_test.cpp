// SPDX-License-Identifier: MIT
#include "jobs/batch/csv.h"

#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "tests/jobs/batch/scratch_folder.h"

namespace rattan {
namespace {

using Row = std::vector<std::string>;
using ::testing::HasSubstr;
using Rows = std::vector<std::pair<std::uint64_t, Row>>;

Rows rows(const std::string& text) {
  CsvReader reader(text, "a.csv");
  Rows all;
  Row row;
  while (reader.next(row)) {
    all.emplace_back(reader.line(), row);
  }
  return all;
}

TEST(Csv, ReadsCells) {
  EXPECT_EQ(rows(""), Rows{});
  EXPECT_EQ(rows("a,b\nc,d"), (Rows{{1, {"a", "b"}}, {2, {"c", "d"}}}));
  EXPECT_EQ(rows("a,b\r\nc,\r\n"), (Rows{{1, {"a", "b"}}, {2, {"c", ""}}}));
  EXPECT_EQ(rows("a\rb\r"), (Rows{{1, {"a"}}, {2, {"b"}}}));
  EXPECT_EQ(rows("\xef\xbb\xbfpath\n"), (Rows{{1, {"path"}}}));
  EXPECT_EQ(rows("a\n\n,,\n \nb\n"), (Rows{{1, {"a"}}, {4, {" "}}, {5, {"b"}}}));
  EXPECT_EQ(rows("# no comment,x\n"), (Rows{{1, {"# no comment", "x"}}}));
}

TEST(Csv, ReadsQuotes) {
  EXPECT_EQ(rows("\"a,b\",\"c\"\"d\"\n"), (Rows{{1, {"a,b", "c\"d"}}}));
  EXPECT_EQ(rows("\"two\nlines\",x\ny,\"\"\n"), (Rows{{1, {"two\nlines", "x"}}, {3, {"y", ""}}}));
  EXPECT_EQ(rows("\"two\r\nlines\"\r\nz"), (Rows{{1, {"two\r\nlines"}}, {3, {"z"}}}));
}

TEST(Csv, NamesTheLineOfBadQuotes) {
  EXPECT_THAT(sentence_of<UsageError>([] { rows("a\nb\"c\n"); }),
              HasSubstr("a.csv: line 2: a quote"));
  EXPECT_THAT(sentence_of<UsageError>([] { rows("a\n\"b\nc\n"); }),
              HasSubstr("a.csv: line 2: a quote is opened and never closed"));
  EXPECT_THAT(sentence_of<UsageError>([] { rows("a\n\"b\"c\n"); }), HasSubstr("a.csv: line 2: "));
}

TEST(Csv, RoundTrip) {
  std::mt19937 random(3);
  for (int k = 0; k < 2000; ++k) {
    Row row;
    std::string text;
    for (std::size_t n = 1 + random() % 4; n > 0; --n) {
      std::string cell;
      for (std::size_t m = random() % 6; m > 0; --m) {
        cell += "ab ,\"\n\r"[random() % 7];
      }
      if (!row.empty()) {
        text += ',';
      }
      text += csv_cell(cell);
      row.push_back(cell);
    }
    row.emplace_back("end");
    text += ",end\n";
    ASSERT_EQ(rows(text), (Rows{{1, row}})) << text;
  }
}

}  // namespace
}  // namespace rattan
