// SPDX-License-Identifier: MIT
#include "jobs/batch/batch_item.h"

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/jobs/batch/scratch_folder.h"

namespace rattan {
namespace {

TEST(BatchItem, KeyFollowsWhatDecidesTheBytes) {
  const RemeshOptions usual;
  RemeshOptions other;
  other.threads = 3;
  other.memory = std::uint64_t{1} << 30;
  other.work_dir = "/scratch";
  other.keep_work = true;
  EXPECT_EQ(item_key(other), item_key(usual));
  other.preview = "/a.png";  // nobody has made that
  EXPECT_NE(item_key(other), item_key(usual));

  other = usual;
  other.density = 1;  // what it would be anyway
  EXPECT_EQ(item_key(other), item_key(usual));
  other.density = 2;
  EXPECT_NE(item_key(other), item_key(usual));

  other = usual;
  other.sizes = {0.05, 0.1};
  EXPECT_NE(item_key(other), item_key(usual));
  other.sizes = {0.1, 0.05};  // their places are in names
  RemeshOptions turned = usual;
  turned.sizes = {0.05, 0.1};
  EXPECT_NE(item_key(other), item_key(turned));
}

TEST(BatchItem, KeyFollowsTheFieldFile) {
  const ScratchFolder folder;
  RemeshOptions options;
  const std::string none = item_key(options);
  options.field = folder.write("a.txt", "1 0 0\n");
  const std::string first = item_key(options);
  EXPECT_NE(first, none);
  std::filesystem::create_directory(folder / "b");
  std::filesystem::rename(options.field, folder / "b/c.txt");
  options.field = folder / "b/c.txt";
  EXPECT_EQ(item_key(options), first);  // the same file elsewhere
  folder.write("b/c.txt", "1 0 0\n0 1 0\n");
  EXPECT_NE(item_key(options), first);
}

TEST(BatchItem, OutputsByTheTemplate) {
  ItemOptions options;
  options.remesh.size_kind = SizeKind::kFaces;
  options.remesh.sizes = {50000, 10000};
  BatchItem item;
  item.id = "a/b.drc";
  item.what = std::make_shared<const ItemOptions>(options);
  EXPECT_EQ(item_outputs(item), (std::vector<std::string>{"a/b-50000.drc", "a/b-10000.drc"}));
  item.id = "a/{n}/b.drc";
  EXPECT_EQ(item_outputs(item), (std::vector<std::string>{"a/1/b.drc", "a/2/b.drc"}));
  item.what = std::make_shared<const ItemOptions>();
  item.id = "a/b.drc";
  EXPECT_EQ(item_outputs(item), std::vector<std::string>{"a/b.drc"});
}

TEST(FileStamp, TellsFilesApart) {
  const ScratchFolder folder;
  const std::string path = folder.write("a.ply", "12345");
  const FileStamp stamp = FileStamp::of(path);
  EXPECT_EQ(stamp.bytes, 5U);
  EXPECT_GT(stamp.time, std::int64_t{1'600'000'000} * 1'000'000'000);
  EXPECT_EQ(stamp, FileStamp::of(path));
  EXPECT_EQ(FileStamp::of(folder / "none"), FileStamp{});
}

}  // namespace
}  // namespace rattan
