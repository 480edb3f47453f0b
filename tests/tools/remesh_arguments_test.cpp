// SPDX-License-Identifier: MIT
#include "tools/rattan/remesh_arguments.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "tests/jobs/batch/scratch_folder.h"

namespace rattan {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using Words = std::vector<std::string>;

RemeshOptions parsed(Words words) {
  CLI::App app;
  RemeshArguments args;
  add_scan_options(app, args);
  add_run_options(app, args);
  std::reverse(words.begin(), words.end());
  app.parse(words);
  return args.resolve();
}

// For every option a value that isn't its default, as somebody may write it, and as words.
const std::map<std::string, std::pair<std::string, Words>> kSamples = {
    {"faces", {"50k,1.5M", {"--faces", "50000,1500000"}}},
    {"edge-length", {"0.50", {"--edge-length", "0.5"}}},
    {"ratio", {"0.10", {"--ratio", "0.1"}}},
    {"density", {"2", {"--density", "2"}}},
    {"merge-vertices", {"", {"--merge-vertices"}}},
    {"drop-components", {"100", {"--drop-components", "100"}}},
    {"fill-holes", {"32", {"--fill-holes", "32"}}},
    {"field", {"/a b.txt", {"--field", "/a b.txt"}}},
    {"symmetry", {"2", {"--symmetry", "2"}}},
    {"smoothing", {"0.30", {"--smoothing", "0.3"}}},
    {"curl-correction", {"", {"--curl-correction"}}},
    {"crease", {"off", {"--crease", "off"}}},
    {"energy", {"edge", {"--energy", "edge"}}},
    {"solver", {"reference", {"--solver", "reference"}}},
    {"newton-steps", {"3", {"--newton-steps", "3"}}},
    {"pure-quads", {"", {"--pure-quads"}}},
    {"position-bits", {"14", {"--position-bits", "14"}}},
    {"memory", {"2GiB", {"--memory", "2147483648"}}},
    {"threads", {"3", {"--threads", "3"}}},
    {"work-dir", {"/w", {"--work-dir", "/w"}}},
    {"keep-work", {"", {"--keep-work"}}},
    {"preview", {"/p.png", {"--preview", "/p.png"}}},
};

TEST(OptionWords, RepeatEveryOption) {
  const RowParser parser;
  for (const std::string& column : parser.columns()) {
    ASSERT_TRUE(kSamples.contains(column)) << "no sample for a new option: " << column;
    const auto& [value, words] = kSamples.at(column);
    Words given = {"--" + column};
    if (!value.empty()) {
      given.push_back(value);
    }
    const RemeshOptions options = parsed(given);
    EXPECT_EQ(option_words(options), words);
    EXPECT_EQ(option_words(parsed(words)), words);
    EXPECT_EQ(
        option_words(RowParser().parse({}, {{column, value.empty() ? "yes" : value}}, "/", "p")),
        words);
  }
}

TEST(OptionWords, AllTogetherInAFixedOrder) {
  Words all;
  const RowParser parser;
  for (const std::string& column : parser.columns()) {
    if (column != "edge-length" && column != "ratio") {
      const Words& words = kSamples.at(column).second;
      all.insert(all.end(), words.begin(), words.end());
    }
  }
  EXPECT_EQ(option_words(parsed(all)), all);
  EXPECT_TRUE(option_words({}).empty());
  EXPECT_TRUE(
      option_words(parsed({"--ratio", "0.05", "--crease=35", "--energy", "triangle"})).empty());
}

TEST(OptionWords, KeepNumbersExact) {
  for (const char* number : {"0.1", "0.30000000000000004", "5e-324", "123456789.12345679"}) {
    const RemeshOptions options =
        parsed({"--edge-length", number == std::string("5e-324") ? "1e-30" : number});
    EXPECT_EQ(parsed(option_words(options)).sizes, options.sizes);
  }
  const RemeshOptions third = parsed({"--smoothing", "0.33333333333333331"});
  EXPECT_EQ(parsed(option_words(third)).smoothing, third.smoothing);
}

TEST(RowParser, TheRowWins) {
  RowParser parser;
  RemeshOptions base =
      parsed({"--ratio", "0.1", "--pure-quads", "--crease", "20", "--smoothing", "0.2"});
  const RemeshOptions row =
      parser.parse(base, {{"faces", "20k"}, {"pure-quads", "No"}, {"crease", "off"}}, "/m", "p");
  EXPECT_EQ(row.size_kind, SizeKind::kFaces);
  EXPECT_EQ(row.sizes, std::vector<double>{20000});
  EXPECT_FALSE(row.pure_quads);
  EXPECT_EQ(row.crease, 0.0);
  EXPECT_EQ(row.smoothing, 0.2);
  // One row leaves nothing behind for the next.
  EXPECT_EQ(option_words(parser.parse(base, {}, "/m", "p")), option_words(base));
  EXPECT_EQ(option_words(parser.parse(base, {{"faces", ""}}, "/m", "p")), option_words(base));
}

TEST(RowParser, PathsAreRelativeToTheManifest) {
  RowParser parser;
  const RemeshOptions row = parser.parse(
      {}, {{"field", "f/../a.txt"}, {"work-dir", "/w"}, {"preview", "p.png"}}, "/m", "p");
  EXPECT_EQ(row.field, "/m/a.txt");
  EXPECT_EQ(row.work_dir, "/w");
  EXPECT_EQ(row.preview, "/m/p.png");
}

TEST(RowParser, SaysWhatIsWrong) {
  RowParser parser;
  const auto error = [&](const std::string& column, const std::string& value) {
    return sentence_of<UsageError>([&] {
      parser.parse({}, {{column, value}}, "/", "m.csv: line 3");
    });
  };
  EXPECT_THAT(error("symmetry", "3"), AllOf(StartsWith("m.csv: line 3: "), HasSubstr("symmetry")));
  EXPECT_THAT(error("faces", "many"), AllOf(StartsWith("m.csv: line 3: "), HasSubstr("'many'")));
  EXPECT_THAT(error("pure-quads", "maybe"),
              AllOf(StartsWith("m.csv: line 3: "), HasSubstr("'maybe'")));
  EXPECT_THAT(error("density", "x"), StartsWith("m.csv: line 3: "));
  EXPECT_THAT(error("memory", "lots"), StartsWith("m.csv: line 3: "));
  EXPECT_THAT(error("crease", "2"), StartsWith("m.csv: line 3: "));
  EXPECT_THAT(error("report", "x.json"), HasSubstr("--report"));
  EXPECT_THAT(sentence_of<UsageError>([&] {
                parser.parse({}, {{"faces", "5"}, {"ratio", "0.1"}}, "/", "m.csv: line 3");
              }),
              AllOf(StartsWith("m.csv: line 3: "), HasSubstr("--ratio")));
  EXPECT_NO_THROW(parser.parse({}, {{"symmetry", "2"}}, "/", "p"));  // still of use
}

}  // namespace
}  // namespace rattan
