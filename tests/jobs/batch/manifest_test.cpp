// SPDX-License-Identifier: MIT
#include "jobs/batch/manifest.h"

#include <memory>
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

using ::testing::HasSubstr;
using Options = std::vector<std::pair<std::string, std::string>>;

const std::vector<std::string> kColumns = {"faces", "ratio", "pure-quads", "field", "memory"};

std::vector<ManifestRow> rows(const std::string& file) {
  std::vector<ManifestRow> all;
  read_manifest(file, kColumns, [&](ManifestRow&& row) { all.push_back(std::move(row)); });
  return all;
}

class Manifest : public ::testing::Test {
 protected:
  std::string csv(const std::string& text) { return folder_.write("m.csv", text); }
  std::string json(const std::string& text) { return folder_.write("m.jsonl", text); }
  std::string csv_error(const std::string& text) {
    return sentence_of<UsageError>([&] { rows(csv(text)); });
  }
  std::string json_error(const std::string& text) {
    return sentence_of<UsageError>([&] { rows(json(text)); });
  }
  ScratchFolder folder_;
};

TEST(ManifestName, ByExtension) {
  EXPECT_TRUE(is_manifest_name("a/b.csv"));
  EXPECT_TRUE(is_manifest_name("B.JSONL"));
  EXPECT_FALSE(is_manifest_name("b.json"));
  EXPECT_FALSE(is_manifest_name("csv"));
}

TEST_F(Manifest, ReadsCsv) {
  const std::string file =
      csv("\xef\xbb\xbfpath, output ,cost,faces,pure-quads,\r\n"
          "a.ply,x/a.drc,12.5,\"50k,10k\",yes,\r\n"
          "\r\n"
          " \"b\",,,,\r\n");
  EXPECT_THROW(rows(file), UsageError);  // a quote inside of a cell
  const std::vector<ManifestRow> all =
      rows(csv("\xef\xbb\xbfpath, output ,cost,faces,pure-quads,\r\n"
               "a.ply,x/a.drc,12.5,\"50k,10k\",yes,\r\n"
               "\r\n"
               "\"b, c.ply\",,, 20k\r\n"));
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].path, "a.ply");
  EXPECT_EQ(all[0].output, "x/a.drc");
  EXPECT_EQ(all[0].cost, 12.5);
  EXPECT_EQ(all[0].options, (Options{{"faces", "50k,10k"}, {"pure-quads", "yes"}}));
  EXPECT_EQ(all[0].place, folder_ / "m.csv: line 2");
  EXPECT_EQ(all[1].path, "b, c.ply");
  EXPECT_EQ(all[1].output, "");
  EXPECT_EQ(all[1].cost, 0.0);
  EXPECT_EQ(all[1].options, (Options{{"faces", "20k"}}));
  EXPECT_EQ(all[1].place, folder_ / "m.csv: line 4");
}

TEST_F(Manifest, ReadsJsonLines) {
  const std::vector<ManifestRow> all = rows(json(
      "\xef\xbb\xbf{\"path\": \"a.ply\", \"faces\": 20000, \"pure-quads\": true, \"field\": "
      "null}\r\n"
      "\n"
      "{\"faces\":[50000,\"10k\"],\"cost\":3,\"path\":\"b\\u00e9.ply\",\"output\":\"q\\\".drc\"}"));
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].path, "a.ply");
  EXPECT_EQ(all[0].options, (Options{{"faces", "20000"}, {"pure-quads", "true"}}));
  EXPECT_EQ(all[0].place, folder_ / "m.jsonl: line 1");
  EXPECT_EQ(all[1].path, "b\xc3\xa9.ply");
  EXPECT_EQ(all[1].output, "q\".drc");
  EXPECT_EQ(all[1].cost, 3.0);
  EXPECT_EQ(all[1].options, (Options{{"faces", "50000,10k"}}));
  EXPECT_EQ(all[1].place, folder_ / "m.jsonl: line 3");
}

TEST_F(Manifest, EmptyOnesHaveNoRows) {
  EXPECT_TRUE(rows(csv("")).empty());
  EXPECT_TRUE(rows(csv("path,faces\n")).empty());
  EXPECT_TRUE(rows(json("\n\n")).empty());
}

TEST_F(Manifest, SaysWhatIsWrongAndWhere) {
  EXPECT_THAT(csv_error("path,face\na,1\n"),
              HasSubstr("m.csv: line 1: there is no column 'face'. Did you mean 'faces'?"));
  EXPECT_THAT(csv_error("path,pure_quads\na,1\n"), HasSubstr("Did you mean 'pure-quads'?"));
  EXPECT_THAT(csv_error("path,whatsoever\na,1\n"), HasSubstr("Remove it; there are path, output"));
  EXPECT_THAT(csv_error("path,faces,faces\n"), HasSubstr("two columns 'faces'"));
  EXPECT_THAT(csv_error("file,faces\n"), HasSubstr("no column 'path'"));
  EXPECT_THAT(csv_error("path;faces\n"), HasSubstr("by commas"));
  EXPECT_THAT(csv_error("path,faces\na.ply,50k,10k\n"), HasSubstr("line 2: the row has 3 cells"));
  EXPECT_THAT(csv_error("path,faces\n\n,5\n"), HasSubstr("line 3: the row names no scan"));
  EXPECT_THAT(csv_error("path,cost\na,-1\n"), HasSubstr("line 2: the cost '-1' is no number"));
  EXPECT_THAT(csv_error("path,cost\na,1s\n"), HasSubstr("line 2: the cost '1s'"));
  EXPECT_THAT(csv_error("path,cost\na,inf\n"), HasSubstr("the cost 'inf'"));
  EXPECT_THAT(csv_error("\xff\xfep\0a\0"), HasSubstr("UTF-16"));
  EXPECT_THAT(json_error("{\"path\": \"a\"}\n{\"path\": }\n"),
              HasSubstr("m.jsonl: line 2: this is no JSON"));
  EXPECT_THAT(json_error("[1]\n"), HasSubstr("line 1: this is no JSON object"));
  EXPECT_THAT(json_error("{\"path\":\"a\",\"fases\":1}\n"), HasSubstr("Did you mean 'faces'?"));
  EXPECT_THAT(json_error("{\"path\":\"a\",\"faces\":1,\"faces\":2}\n"), HasSubstr("given twice"));
  EXPECT_THAT(json_error("{\"path\":\"a\",\"faces\":{\"x\":1}}\n"),
              HasSubstr("'faces' has a value"));
  EXPECT_THAT(json_error("{\"path\":\"a\",\"faces\":[[1]]}\n"), HasSubstr("'faces' has a value"));
  EXPECT_THAT(json_error("{\"path\":\"a\",\"faces\":1e999}\n"), HasSubstr("line 1: a number"));
  EXPECT_THAT(json_error("{\"faces\":1}\n"), HasSubstr("names no scan"));
  EXPECT_THAT(json_error("{\"path\":\"a\\u0000b\"}\n"), HasSubstr("zero byte"));
  EXPECT_THAT(json_error("{\"path\":\"a\xff\"}\n"), HasSubstr("line 1"));
  EXPECT_THROW(rows(folder_ / "none.csv"), InputError);
}

// Whatever is in the file: rows, or a sentence with file and line.
TEST_F(Manifest, DamageIsSaid) {
  const std::string texts[] = {
      "path,output,cost,faces\r\n\"a,b.ply\",x.drc,1.5,\"50k,10k\"\r\nc.ply,,,\r\n",
      "{\"path\":\"a.ply\",\"cost\":1e3,\"faces\":[5,\"10k\"]}\n{\"path_hex\":\"61e9\",\"ratio\":0."
      "1}\n"};
  std::mt19937 random(11);
  int refused = 0;
  for (int k = 0; k < 4000; ++k) {
    const bool as_csv = k % 2 == 0;
    std::string text = texts[as_csv ? 0 : 1];
    for (std::size_t n = 1 + random() % 3; n > 0 && !text.empty(); --n) {
      const std::size_t at = random() % text.size();
      switch (random() % 4) {
        case 0:
          text[at] = static_cast<char>(random() % 256);
          break;
        case 1:
          text.erase(at, 1 + random() % 9);
          break;
        case 2:
          text.insert(at, 1, "\",{}[]:9e\n"[random() % 10]);
          break;
        default:
          text.resize(at);
      }
    }
    const std::string file = as_csv ? csv(text) : json(text);
    try {
      for (const ManifestRow& row : rows(file)) {
        ASSERT_FALSE(row.path.empty());
        ASSERT_GE(row.cost, 0.0);
      }
    } catch (const UsageError& e) {
      ++refused;
      ASSERT_THAT(e.what(), ::testing::StartsWith(file + ": "));
    }
  }
  EXPECT_GT(refused, 1000);
}

std::shared_ptr<const ItemOptions> with(std::vector<std::string> words) {
  ItemOptions options;
  options.words = std::move(words);
  return std::make_shared<const ItemOptions>(std::move(options));
}

BatchItem item(std::string id, std::string scan, std::shared_ptr<const ItemOptions> what,
               double cost = 0.0) {
  BatchItem made;
  made.id = std::move(id);
  made.scan = std::move(scan);
  made.what = std::move(what);
  made.cost = cost;
  return made;
}

TEST_F(Manifest, RoundTripIsExact) {
  const auto usual = with({});
  const auto list = with({"--faces", "50000,10000", "--pure-quads", "--field", "/a, \"b\"\n.txt"});
  const std::vector<BatchItem> items = {
      item("a.drc", "/s/a.ply", usual), item("b/\xc3\xa9,\".drc", "/s/ b\n.ply", list, 0.1),
      item("c.drc", "/s/c.ply", with({"--ratio", "0.1", "--memory", "1073741824"}), 1.0 / 3.0)};
  const std::vector<double> costs = {1e-7, 0.1 + 0.2, 12345678.9};
  for (const char* name : {"r.csv", "r.jsonl"}) {
    const std::string file = folder_ / name;
    for (const bool own : {true, false}) {
      write_manifest(file, items, own ? std::vector<double>{} : costs);
      const std::vector<ManifestRow> all = rows(file);
      ASSERT_EQ(all.size(), items.size());
      for (std::size_t i = 0; i < items.size(); ++i) {
        EXPECT_EQ(all[i].path, items[i].scan);
        EXPECT_EQ(all[i].output, items[i].id);
        EXPECT_EQ(all[i].cost, own ? items[i].cost : costs[i]);
      }
      EXPECT_TRUE(all[0].options.empty());
      EXPECT_EQ(all[1].options, (Options{{"faces", "50000,10000"},
                                         {"pure-quads", "true"},
                                         {"field", "/a, \"b\"\n.txt"}}));
      EXPECT_EQ(all[2].options, (Options{{"ratio", "0.1"}, {"memory", "1073741824"}}));
    }
  }
}

TEST_F(Manifest, UnwritablePlacesAreSaid) {
  EXPECT_THROW(write_manifest(folder_ / "none/m.csv", {}, {}), InputError);
}

TEST(NearestWord, FindsTypos) {
  const std::vector<std::string> words = {"path", "output", "faces", "pure-quads"};
  EXPECT_EQ(nearest_word("fases", words), "faces");
  EXPECT_EQ(nearest_word("purequads", words), "pure-quads");
  EXPECT_EQ(nearest_word("Output", words), "output");
  EXPECT_EQ(nearest_word("x", words), "");
  EXPECT_EQ(nearest_word("something", words), "");
}

}  // namespace
}  // namespace rattan
