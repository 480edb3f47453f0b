// SPDX-License-Identifier: MIT
#include "jobs/batch/collect.h"

#include <filesystem>
#include <string>
#include <unistd.h>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "tests/jobs/batch/scratch_folder.h"

namespace rattan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using Names = std::vector<std::string>;

Names walk(const std::string& folder, const WalkOptions& options = {}) {
  Names names;
  walk_scans(folder, options, [&](FoundScan&& scan) {
    EXPECT_EQ(scan.path, folder + "/" + scan.relative);
    names.push_back(scan.relative);
  });
  return names;
}

TEST(ScanName, Splits) {
  const auto split = [](const char* name) {
    const ScanName parts = split_scan_name(name);
    return parts.stem + "|" + parts.extension;
  };
  EXPECT_EQ(split("koala.ply"), "koala|ply");
  EXPECT_EQ(split("koala.v2.PLY"), "koala.v2|PLY");
  EXPECT_EQ(split("koala.ply.gz"), "koala|ply.gz");
  EXPECT_EQ(split("koala.gz"), "koala|gz");
  EXPECT_EQ(split("koala"), "koala|");
  EXPECT_EQ(split(".ply"), ".ply|");
  EXPECT_EQ(split("a."), "a.|");
}

TEST(ScanName, KnowsExtensions) {
  for (const char* name : {"a.ply", "a.OBJ", "a.Stl", "a.off", "a.drc", "a.ply.gz", "a.OBJ.ZST"}) {
    EXPECT_TRUE(has_scan_extension(name)) << name;
  }
  for (const char* name :
       {"a", "a.txt", "ply", ".ply", "a.gz", "a.ply.bz2", "a.txt.gz", "a.drc.log"}) {
    EXPECT_FALSE(has_scan_extension(name)) << name;
  }
}

TEST(WalkScans, GoesDownInOrder) {
  const ScratchFolder folder;
  for (const char* name :
       {"b.ply", "a.obj", "Z.stl", "sub/c.off", "sub/deep/d.drc", "sub-x/e.ply.gz", "notes.txt",
        "sub/.hidden.ply", ".cache/f.ply", "._b.ply"}) {
    folder.write(name);
  }
  fs::create_directories(folder / "empty.ply");
  EXPECT_EQ(walk(folder.path()),
            (Names{"Z.stl", "a.obj", "b.ply", "sub/c.off", "sub/deep/d.drc", "sub-x/e.ply.gz"}));
}

TEST(WalkScans, TakesSizeAndTime) {
  const ScratchFolder folder;
  const std::string path = folder.write("a.ply", "123");
  walk_scans(folder.path(), {}, [&](FoundScan&& scan) {
    EXPECT_EQ(scan.stamp, FileStamp::of(path));
    EXPECT_EQ(scan.stamp.bytes, 3U);
  });
}

TEST(WalkScans, FollowsLinksOnce) {
  const ScratchFolder folder;
  folder.write("scans/z/a.ply");
  folder.write("elsewhere/b.ply");
  fs::create_directory_symlink("..", folder / "scans/z/up");  // a loop
  fs::create_directory_symlink("z", folder / "scans/again");  // what is found anyway
  fs::create_directory_symlink(folder / "elsewhere", folder / "scans/far");
  fs::create_directory_symlink(folder / "elsewhere", folder / "scans/near");
  fs::create_symlink("z/a.ply", folder / "scans/link.ply");
  fs::create_symlink("nowhere", folder / "scans/broken.ply");
  fs::create_symlink("self.ply", folder / "scans/self.ply");
  EXPECT_EQ(walk(folder / "scans"),
            (Names{"broken.ply", "link.ply", "self.ply", "z/a.ply", "far/b.ply"}));
  walk_scans(folder / "scans", {}, [](FoundScan&& scan) {
    EXPECT_EQ(scan.stamp == FileStamp{},
              scan.relative == "broken.ply" || scan.relative == "self.ply");
  });
}

TEST(WalkScans, LeavesOutTheFolderOfOutputs) {
  const ScratchFolder folder;
  folder.write("a.ply");
  folder.write("out/a.drc");
  folder.write("out/sub/a.drc");
  fs::create_directory_symlink("out", folder / "link");
  EXPECT_EQ(walk(folder.path(), {.filter = {}, .skip = folder / "out"}), Names{"a.ply"});
  EXPECT_EQ(walk(folder.path(), {.filter = {}, .skip = folder / "link"}), Names{"a.ply"});
  EXPECT_EQ(walk(folder.path(), {.filter = {}, .skip = folder / "none"}).size(), 3U);
}

TEST(WalkScans, Filters) {
  const ScratchFolder folder;
  for (const char* name : {"a.ply", "b.obj", "old/c.ply", "new/d.ply", "new/raw/e.ply"}) {
    folder.write(name);
  }
  EXPECT_EQ(
      walk(folder.path(), {.filter = PathFilter({"*.ply"}, {"old", "new/raw/**"}), .skip = ""}),
      (Names{"a.ply", "new/d.ply"}));
}

TEST(WalkScans, NamesAFolderThatCantBeListed) {
  const ScratchFolder folder;
  const std::string none = folder / "none";
  EXPECT_THAT(sentence_of<InputError>([&] { walk(none); }), HasSubstr(none));
  if (::geteuid() == 0) {
    GTEST_SKIP() << "root may list any folder";
  }
  folder.write("a/b.ply");
  fs::permissions(folder / "a", fs::perms::none);
  EXPECT_THAT(sentence_of<InputError>([&] { walk(folder.path()); }), HasSubstr("--exclude"));
  EXPECT_EQ(walk(folder.path(), {.filter = PathFilter({}, {"a"}), .skip = ""}), Names{});
  fs::permissions(folder / "a", fs::perms::owner_all);
}

TEST(WalkScans, NeedsNoDeepStack) {
  const ScratchFolder folder;
  std::string deep;
  for (int k = 0; k < 300; ++k) {
    deep += "d/";
  }
  folder.write(deep + "a.ply");
  EXPECT_EQ(walk(folder.path()), Names{deep + "a.ply"});
}

}  // namespace
}  // namespace rattan
