// SPDX-License-Identifier: MIT
#include "io/layout/transition_writer.h"

#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "engine/core/errors.h"
#include "io/file/atomic_file.h"
#include "tests/engine/layout/polygon_layout.h"
#include "tests/io/test_meshes.h"

namespace rattan {
namespace {

using testing::ScratchDirectory;

std::vector<ChartKind> kinds_of(const testing::PolygonLayout& layout) {
  std::vector<ChartKind> out;
  for (const FlatChart& chart : layout.charts) {
    out.push_back(chart.kind);
  }
  return out;
}

TEST(TransitionWriter, WritesEveryPartAndUnitSide) {
  const ScratchDirectory scratch;
  RemeshMetadata metadata;
  metadata.version = "9.8.7";
  metadata.options = "--odd \"quoted\\path\"\n\x01 caf\xc3\xa9 \xff";
  for (const auto& [name, mesh] : testing::polygon_meshes()) {
    SCOPED_TRACE(name);
    const testing::PolygonLayout layout(mesh);
    const Transitions all = transitions_of(layout.graph);
    const std::string path = transitions_path(scratch.file(name + ".obj"));
    EXPECT_EQ(path, scratch.file(name + ".charts.json"));
    const std::uint64_t bytes = write_transitions(all, kinds_of(layout), metadata, path);
    EXPECT_EQ(bytes, std::filesystem::file_size(path));
    const nlohmann::json read = nlohmann::json::parse(read_file(path));
    EXPECT_EQ(read["rattan"], "9.8.7");
    EXPECT_EQ(read["options"], "--odd \"quoted\\path\"\n\x01 caf\xc3\xa9 ?");
    EXPECT_EQ(read["chart_side"], all.units);
    EXPECT_EQ(read["charts"], layout.charts.size());
    ASSERT_EQ(read["parts"].size(), all.parts.size());
    for (std::size_t i = 0; i < all.parts.size(); ++i) {
      const auto& part = read["parts"][i];
      EXPECT_EQ(part["part"], i);
      EXPECT_EQ(part["chart"], all.parts[i].chart);
      EXPECT_EQ(part["corner"], all.parts[i].corner);
      EXPECT_EQ(part["kind"], all.parts[i].split ? "split" : "unfolded");
      EXPECT_EQ(part["length"], all.parts[i].split ? 1U : all.units);
    }
    ASSERT_EQ(read["transitions"].size(), all.pairs.size());
    for (std::size_t i = 0; i < all.pairs.size(); ++i) {
      const auto& t = read["transitions"][i];
      const Transition& meant = all.pairs[i];
      EXPECT_EQ(t["part_a"], meant.a.part);
      EXPECT_EQ(t["side_a"], meant.a.side);
      EXPECT_EQ(t["unit_a"], meant.a.unit);
      EXPECT_EQ(t["part_b"], meant.b.part);
      EXPECT_EQ(t["side_b"], meant.b.side);
      EXPECT_EQ(t["unit_b"], meant.b.unit);
      EXPECT_EQ(t["turn"], meant.turn);
      EXPECT_EQ(t["s"], meant.s);
      EXPECT_EQ(t["t"], meant.t);
      EXPECT_EQ(t["strand"].is_null(), meant.strand == kNoStrand);
    }
    ASSERT_EQ(read["boundary"].size(), all.boundary.size());
    for (std::size_t i = 0; i < all.boundary.size(); ++i) {
      EXPECT_EQ(read["boundary"][i]["part"], all.boundary[i].side.part);
      EXPECT_EQ(read["boundary"][i]["strand"], all.boundary[i].strand);
    }
  }
}

TEST(TransitionWriter, LeavesNothingAfterDamage) {
  const ScratchDirectory scratch;
  const testing::PolygonLayout layout(testing::polygon_cube());
  const Transitions all = transitions_of(layout.graph);
  const auto damage = [](const std::string& temporary) {
    std::fstream file(temporary, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(500);
    file.put('!');
  };
  const auto append = [](const std::string& temporary) {
    std::ofstream(temporary, std::ios::app) << "\n";
  };
  const std::string path = scratch.file("a.charts.json");
  EXPECT_THROW(write_transitions(all, kinds_of(layout), {}, path, damage), InternalError);
  EXPECT_THROW(write_transitions(all, kinds_of(layout), {}, path, append), InternalError);
  EXPECT_THROW(write_transitions(all, {}, {}, path), InternalError);
  EXPECT_TRUE(scratch.names().empty());
}

}  // namespace
}  // namespace rattan
