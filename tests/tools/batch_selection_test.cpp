// SPDX-License-Identifier: MIT
#include "tools/rattan/batch_selection.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "jobs/batch/manifest.h"
#include "tests/jobs/batch/scratch_folder.h"

namespace rattan {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Words = std::vector<std::string>;

class Selection : public ::testing::Test {
 protected:
  std::vector<BatchItem> select(Words words) {
    CLI::App app;
    BatchSelection selection;
    add_selection_options(app, selection);
    std::reverse(words.begin(), words.end());
    app.parse(words);
    warnings_.clear();
    return select_items(selection, [&](const std::string& text) { warnings_.push_back(text); });
  }
  Words ids(const Words& words) {
    Words all;
    for (const BatchItem& item : select(words)) {
      all.push_back(item.id);
    }
    return all;
  }
  std::string error(const Words& words) {
    return sentence_of<UsageError>([&] { select(words); });
  }
  std::string at(const std::string& name) const { return folder_ / name; }

  ScratchFolder folder_;
  Words warnings_;
};

TEST_F(Selection, FolderKeepsItsStructure) {
  folder_.write("scans/b.ply", "12");
  folder_.write("scans/rome/a.obj");
  folder_.write("scans/notes.txt");
  const std::vector<BatchItem> items = select({at("scans/"), "-o", at("out"), "--faces", "20k"});
  ASSERT_EQ(items.size(), 2U);
  EXPECT_EQ(items[0].id, "b.drc");
  EXPECT_EQ(items[0].scan, at("scans/b.ply"));
  EXPECT_EQ(items[0].scan_bytes, 2U);
  EXPECT_EQ(items[0].scan_time, FileStamp::of(at("scans/b.ply")).time);
  EXPECT_EQ(items[1].id, "rome/a.drc");
  EXPECT_EQ(items[0].what, items[1].what);
  EXPECT_EQ(items[0].what->words, (Words{"--faces", "20000"}));
  EXPECT_EQ(items[0].what->key, item_key(items[0].what->remesh));
  EXPECT_FALSE(fs::exists(at("out")));
}

TEST_F(Selection, FilesAndOrder) {
  folder_.write("b.ply");
  folder_.write("x/a.weird");
  EXPECT_THAT(ids({at("x/a.weird"), at("b.ply"), "-o", at("out")}), ElementsAre("a.drc", "b.drc"));
  EXPECT_THAT(ids({at("b.ply"), at("x/a.weird"), at("b.ply"), "-o", at("out"), "--format", "ply"}),
              ElementsAre("a.ply", "b.ply"));
}

TEST_F(Selection, WhatCantBeReadIsForTheRunToSay) {
  const std::vector<BatchItem> items = select({at("gone.ply"), "-o", at("out")});
  ASSERT_EQ(items.size(), 1U);
  EXPECT_EQ(items[0].scan_bytes, 0U);
  EXPECT_EQ(items[0].scan_time, 0);
  EXPECT_THAT(error({at("gone"), "-o", at("out")}), HasSubstr("no such file or folder"));
}

TEST_F(Selection, NamesByTemplate) {
  folder_.write("a/x/k.ply");
  folder_.write("a/x/k.obj.gz");
  EXPECT_THAT(error({at("a"), "-o", at("out")}), AllOf(HasSubstr("x/k.drc"), HasSubstr("k.obj.gz"),
                                                       HasSubstr("k.ply"), HasSubstr("{ext}")));
  EXPECT_THAT(ids({at("a"), "-o", at("out"), "--name", "{dir}/{stem}-{ext}.drc"}),
              ElementsAre("x/k-obj.gz.drc", "x/k-ply.drc"));
  EXPECT_THAT(ids({at("a"), "-o", at("out"), "--name", "{root}-{stem}-{ext}", "--format", "obj"}),
              ElementsAre("a-k-obj.gz.obj", "a-k-ply.obj"));
  EXPECT_THAT(error({at("a"), "-o", at("out"), "--name", "{stem}.drc", "--format", "obj"}),
              HasSubstr("--format"));
  EXPECT_THAT(error({at("a"), "-o", at("out"), "--name", "../{stem}.drc"}), HasSubstr("below"));
}

TEST_F(Selection, TwoFoldersMayMeet) {
  folder_.write("a/k.ply");
  folder_.write("b/k.ply");
  EXPECT_THAT(error({at("a"), at("b"), "-o", at("out")}), HasSubstr("{root}"));
  EXPECT_THAT(ids({at("a"), at("b"), "-o", at("out"), "--name", "{root}/{dir}/{stem}.drc"}),
              ElementsAre("a/k.drc", "b/k.drc"));
}

TEST_F(Selection, AFileNamedTwiceIsTakenOnce) {
  folder_.write("a/s/k.ply");
  EXPECT_THAT(ids({at("a"), at("a/s"), at("a/s/k.ply"), "-o", at("out")}), ElementsAre("s/k.drc"));
  EXPECT_EQ(warnings_.size(), 1U);  // nothing is taken from a/s
  EXPECT_THAT(ids({at("a/../a/s"), at("a"), "-o", at("out")}), ElementsAre("k.drc"));
}

TEST_F(Selection, OutputsInsideTheFolderAreNoScans) {
  folder_.write("a/k.ply");
  folder_.write("a/out/k.drc");
  EXPECT_THAT(ids({at("a"), "-o", at("a/out")}), ElementsAre("k.drc"));
  fs::remove_all(at("a/out"));
  EXPECT_THAT(error({at("a"), "-o", at("a")}),
              AllOf(HasSubstr("among the scans"), HasSubstr("-o")));
  EXPECT_THAT(ids({at("a"), "-o", at("a"), "--include", "*.ply"}), ElementsAre("k.drc"));
  EXPECT_THAT(ids({at("a/k.ply"), "-o", at("a")}), ElementsAre("k.drc"));
  EXPECT_THAT(error({at("a/k.ply"), "-o", at("a"), "--format", "ply"}), HasSubstr("would replace"));
  EXPECT_THAT(ids({at("a"), "-o", folder_.path()}), ElementsAre("k.drc"));
  EXPECT_THAT(error({at("a"), "-o", folder_.path(), "--name", "{root}/{stem}.drc"}),
              HasSubstr("among the scans"));
}

TEST_F(Selection, NothingIsAnError) {
  fs::create_directories(at("empty"));
  EXPECT_THAT(error({"-o", at("out")}), HasSubstr("No scans were named"));
  EXPECT_THAT(error({at("empty"), "-o", at("out")}), HasSubstr("no scans here"));
  folder_.write("a/k.ply");
  EXPECT_THAT(error({at("a"), "-o", at("out"), "--include", "*.obj"}), HasSubstr("--include"));
  EXPECT_THAT(ids({at("a"), at("empty"), "-o", at("out")}), ElementsAre("k.drc"));
  EXPECT_EQ(warnings_.size(), 1U);
  EXPECT_THAT(error({at("a"), "-o", folder_.write("file")}), HasSubstr("no folder"));
}

TEST_F(Selection, ManifestRowsWin) {
  folder_.write("s/a.ply");
  folder_.write("s/b/c.ply");
  folder_.write("list/m.csv",
                "path,output,cost,faces,pure-quads,field\n"
                "../s/a.ply,special.obj,2.5,\"50k,10k\",,f.txt\n"
                "gone/d.ply,,,,no,\n");
  const std::vector<BatchItem> items =
      select({at("s"), at("list/m.csv"), "-o", at("out"), "--pure-quads", "--ratio", "0.1"});
  ASSERT_EQ(items.size(), 3U);
  EXPECT_EQ(items[0].id, "b/c.drc");
  EXPECT_EQ(items[0].what->words, (Words{"--ratio", "0.1", "--pure-quads"}));
  EXPECT_EQ(items[1].id, "gone/d.drc");
  EXPECT_EQ(items[1].what->words, (Words{"--ratio", "0.1"}));
  EXPECT_EQ(items[2].id, "special.obj");
  EXPECT_EQ(items[2].scan, at("s/a.ply"));
  EXPECT_EQ(items[2].cost, 2.5);
  EXPECT_EQ(items[2].what->words,
            (Words{"--faces", "50000,10000", "--field", at("list/f.txt"), "--pure-quads"}));
}

TEST_F(Selection, ManifestErrorsNameTheLine) {
  const auto row = [&](const std::string& text) {
    return error({folder_.write("m.csv", text), "-o", at("out")});
  };
  EXPECT_THAT(row("path,symmetry\na.ply,2\na.ply,3\n"), HasSubstr("m.csv: line 3: "));
  EXPECT_THAT(row("path,output\na.ply,../a.drc\n"), HasSubstr("m.csv: line 2: "));
  EXPECT_THAT(row("path,output\na.ply,a.stl\n"), HasSubstr(".drc, .obj, .ply or .off"));
  EXPECT_THAT(row("path,preview\na.ply,p.png\nb.ply,p.png\n"), HasSubstr("both"));
  EXPECT_THAT(row("path,faces\na.ply,5\na.ply,6\n"), HasSubstr("asked for twice"));
}

TEST_F(Selection, WrittenManifestSelectsTheSame) {
  folder_.write("s/a.ply");
  folder_.write("s/b/c,\"d\".ply");
  folder_.write("s/\xc3\xa9 f.ply");
  folder_.write("s/\xe9.ply");  // no UTF-8
  folder_.write("m.jsonl",
                "{\"path\":\"s/a.ply\",\"faces\":[20000,5000],\"memory\":\"1GiB\",\"cost\":0.1}\n"
                "{\"path\":\"s/a.ply\",\"output\":\"fine/{n}.ply\",\"ratio\":\"0.1,0.2\"}\n");
  const std::vector<BatchItem> first =
      select({at("s"), at("m.jsonl"), "-o", at("out"), "--pure-quads", "--crease", "off"});
  ASSERT_EQ(first.size(), 5U);
  for (const char* name : {"w.csv", "w.jsonl"}) {
    write_manifest(at(name), first, {});
    const std::vector<BatchItem> again = select({at(name), "-o", at("out")});
    ASSERT_EQ(again.size(), first.size());
    for (std::size_t i = 0; i < first.size(); ++i) {
      EXPECT_EQ(again[i].id, first[i].id);
      EXPECT_EQ(again[i].scan, first[i].scan);
      EXPECT_EQ(again[i].what->words, first[i].what->words);
      EXPECT_EQ(again[i].what->key, first[i].what->key);
      EXPECT_EQ(again[i].cost, first[i].cost);
      EXPECT_EQ(again[i].scan_bytes, first[i].scan_bytes);
      EXPECT_EQ(again[i].scan_time, first[i].scan_time);
    }
  }
}

TEST_F(Selection, ManyFilesShareTheirOptions) {
  std::string text = "path,faces\n";
  for (int k = 0; k < 3000; ++k) {
    text += 'a';
    text += std::to_string(k);
    text += ".ply,";
    text += std::to_string(k % 3 + 1);
    text += '\n';
  }
  const std::vector<BatchItem> items = select({folder_.write("m.csv", text), "-o", at("out")});
  ASSERT_EQ(items.size(), 3000U);
  std::vector<const ItemOptions*> options;
  for (const BatchItem& item : items) {
    options.push_back(item.what.get());
  }
  std::sort(options.begin(), options.end());
  EXPECT_EQ(std::unique(options.begin(), options.end()) - options.begin(), 3);
}

}  // namespace
}  // namespace rattan
