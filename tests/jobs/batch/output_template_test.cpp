// SPDX-License-Identifier: MIT
#include "jobs/batch/output_template.h"

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "tests/jobs/batch/scratch_folder.h"

namespace rattan {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

std::string expand(const std::string& text, const ScanPlace& place) {
  return OutputTemplate(text)(place);
}

TEST(OutputTemplate, Expands) {
  const ScanPlace place{"scans", "rome/statues", "koala.v2.ply.gz"};
  EXPECT_EQ(expand("{dir}/{stem}.drc", place), "rome/statues/koala.v2.drc");
  EXPECT_EQ(expand("{stem}-{ext}.obj", place), "koala.v2-ply.gz.obj");
  EXPECT_EQ(expand("{root}/{stem}/{size}/{n}.drc", place), "scans/koala.v2/{size}/{n}.drc");
  EXPECT_EQ(expand("x.drc", place), "x.drc");
  EXPECT_EQ(expand("{dir}/{stem}.drc", {"scans", "", "{stem}.ply"}), "{stem}.drc");
}

TEST(OutputTemplate, RefusesOtherBraces) {
  EXPECT_THAT(sentence_of<UsageError>([] { OutputTemplate("{name}.drc"); }),
              AllOf(HasSubstr("'{name}'"), HasSubstr("{stem}")));
  EXPECT_THROW(OutputTemplate("{stem.drc"), UsageError);
}

TEST(CheckedOutput, StaysBelowTheFolder) {
  EXPECT_EQ(checked_output("a/./b/../c.drc", "p"), "a/c.drc");
  EXPECT_EQ(checked_output("a//c.ply", "p"), "a/c.ply");
  for (const char* bad : {"/a.drc", "../a.drc", "a/../../b.drc", "", ".", "a", "a.stl", "a.drc.gz",
                          ".rattan/a.drc", "x/../.rattan/journal/a.drc", ".drc", "a/"}) {
    EXPECT_THAT(sentence_of<UsageError>([&] { checked_output(bad, "m.csv: line 2"); }),
                ::testing::StartsWith("m.csv: line 2: "))
        << bad;
  }
}

BatchItem item(std::string id, std::string scan, std::vector<double> sizes = {0.05}) {
  ItemOptions options;
  options.remesh.sizes = std::move(sizes);
  BatchItem made;
  made.id = std::move(id);
  made.scan = std::move(scan);
  made.what = std::make_shared<const ItemOptions>(std::move(options));
  return made;
}

std::string refusal(const std::vector<BatchItem>& items, const std::string& directory = "/o") {
  return sentence_of<UsageError>([&] { check_outputs(items, directory); });
}

TEST(CheckOutputs, LetsDifferentNamesPass) {
  EXPECT_NO_THROW(
      check_outputs(std::vector{item("a.drc", "/s/a.ply"), item("b/a.drc", "/s/b/a.ply"),
                                item("A.drc", "/s/A.ply"), item("b.drc", "/s/b.ply", {0.1, 0.2}),
                                item("b-0.3.drc", "/s/c.ply")},
                    "/o"));
}

TEST(CheckOutputs, NamesBothScansAndTheRemedy) {
  EXPECT_THAT(refusal({item("a.drc", "/s/a.obj"), item("a.drc", "/s/a.ply")}),
              AllOf(HasSubstr("a.drc: this would be the output of /s/a.obj and /s/a.ply."),
                    HasSubstr("--name '{dir}/{stem}-{ext}.drc'")));
  EXPECT_THAT(refusal({item("a.obj", "/s/a.ply"), item("a.obj", "/t/a.ply")}),
              HasSubstr("--name '{root}/{dir}/{stem}.obj'"));
  EXPECT_THAT(refusal({item("a.drc", "/s/a.ply"), item("a.drc", "/s/a.ply")}),
              HasSubstr("asked for twice"));
  EXPECT_THAT(refusal({item("a.drc", "/s/a.ply"), item("a.drc", "/t/a.ply"),
                       item("b.drc", "/s/b.ply"), item("b.drc", "/t/b.ply")}),
              HasSubstr("(and 1 more such outputs)"));
}

TEST(CheckOutputs, LooksAtEverySize) {
  EXPECT_THAT(refusal({item("a.drc", "/s/a.ply", {0.1, 0.2}), item("a-0.2.drc", "/s/a-0.2.ply")}),
              AllOf(HasSubstr("a-0.2.drc: "), HasSubstr("/s/a.ply and /s/a-0.2.ply")));
}

TEST(CheckOutputs, NoFileIsAFolder) {
  EXPECT_THAT(
      refusal({item("a.drc", "/s/a.ply"), item("a.drc/b/c.drc", "/s/c.ply")}),
      AllOf(HasSubstr("a.drc: this would be an output and a folder"), HasSubstr("/s/c.ply")));
}

TEST(CheckOutputs, ReplacesNoScan) {
  EXPECT_THAT(refusal({item("a.ply", "/o/a.obj"), item("b.ply", "/o/a.ply")}),
              AllOf(HasSubstr("/o/a.ply: the remesh of /o/a.obj would replace"), HasSubstr("-o")));
  const ScratchFolder folder;
  const std::string scan = folder.write("scans/a.ply");
  fs::create_directory_symlink("scans", folder / "link");
  EXPECT_THAT(refusal({item("a.ply", scan)}, folder / "link"), HasSubstr("would replace"));
  EXPECT_NO_THROW(check_outputs(std::vector{item("a.drc", scan)}, folder / "link"));
}

}  // namespace
}  // namespace rattan
