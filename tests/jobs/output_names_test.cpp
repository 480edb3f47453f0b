// SPDX-License-Identifier: MIT
#include "jobs/output_names.h"

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/core/errors.h"

namespace rattan {
namespace {

using testing::ElementsAre;

TEST(OutputNames, OneSizeIsWrittenAsGiven) {
  EXPECT_THAT(expand_names("a/{faces}.drc", SizeKind::kFaces, std::vector{500.0}),
              ElementsAre("a/{faces}.drc"));
}

TEST(OutputNames, SizesGoBeforeTheExtension) {
  EXPECT_THAT(expand_names("out/bust.v2.drc", SizeKind::kFaces, std::vector{50000.0, 2000.0}),
              ElementsAre("out/bust.v2-50000.drc", "out/bust.v2-2000.drc"));
  EXPECT_THAT(expand_names("bust.obj", SizeKind::kRatio, std::vector{0.05, 0.2}),
              ElementsAre("bust-0.05.obj", "bust-0.2.obj"));
}

TEST(OutputNames, TemplatesAreFilledIn) {
  const std::vector<double> sizes{900.0, 30.0};
  EXPECT_THAT(expand_names("{n}/x-{faces}.drc", SizeKind::kFaces, sizes),
              ElementsAre("1/x-900.drc", "2/x-30.drc"));
  EXPECT_THAT(expand_names("{size}{size}.drc", SizeKind::kEdgeLength, sizes),
              ElementsAre("900900.drc", "3030.drc"));
  EXPECT_THAT(expand_names("{other}.drc", SizeKind::kFaces, sizes),
              ElementsAre("{other}-900.drc", "{other}-30.drc"));
}

TEST(OutputNames, CollisionsAreRefused) {
  const std::vector<double> same{30.0, 40.0, 30.0};
  EXPECT_THROW(expand_names("x.drc", SizeKind::kFaces, same), UsageError);
  EXPECT_EQ(expand_names("x-{n}.drc", SizeKind::kFaces, same).size(), 3U);
  const std::vector<double> sizes{1.0, 2.0};
  EXPECT_THROW(expand_names("x-{faces}.drc", SizeKind::kRatio, sizes), UsageError);
  EXPECT_THROW(expand_names("{n}/../x.drc", SizeKind::kFaces, sizes), UsageError);
}

TEST(OutputNames, TheScanIsNotWrittenOver) {
  const auto scan = std::filesystem::temp_directory_path() / "rattan-output-names-test.ply";
  std::ofstream(scan) << "ply";
  RemeshOptions options;
  options.scan = scan.string();
  options.output = (scan.parent_path() / "." / scan.filename()).string();
  EXPECT_THROW(output_names(options), UsageError);
  std::filesystem::remove(scan);
  EXPECT_EQ(output_names(options).size(), 1U);
}

TEST(OutputNames, FormatsAndFoldersAreChecked) {
  RemeshOptions options;
  options.size_kind = SizeKind::kFaces;
  options.sizes = {10.0, 20.0};
  options.output = "x.drc";
  EXPECT_THAT(output_names(options), ElementsAre("x-10.drc", "x-20.drc"));
  options.output = "x.xyz";
  EXPECT_THROW(output_names(options), UsageError);
  options.output = "no such folder/x.drc";
  EXPECT_THROW(output_names(options), UsageError);
}

}  // namespace
}  // namespace rattan
