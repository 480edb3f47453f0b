// SPDX-License-Identifier: MIT
#include "io/scan/field_reader.h"

#include <filesystem>
#include <fstream>
#include <unistd.h>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/core/errors.h"

namespace rattan {
namespace {

using testing::HasSubstr;

class FieldReader : public testing::Test {
 protected:
  FieldReader() {
    path_ = (std::filesystem::temp_directory_path() /
             ("rattan-field." + std::to_string(::getpid()) + ".txt"))
                .string();
  }
  ~FieldReader() override { std::filesystem::remove(path_); }

  std::vector<VertexDirection> load(const std::string& text, std::uint64_t expected) {
    std::ofstream(path_, std::ios::binary) << text;
    std::vector<VertexDirection> all;
    hash_ = read_field(path_, expected, [&](std::span<const VertexDirection> d) {
      all.insert(all.end(), d.begin(), d.end());
    });
    return all;
  }

  std::string path_, hash_;
};

TEST_F(FieldReader, LinesCommentsAndFidelity) {
  const auto field =
      load("# a field\r\n1 0 0\r\n\n 0 -3e200 0 0.25 # half sure\n0 0 0 1\n\t0 0 1e-300", 4);
  ASSERT_EQ(field.size(), 4U);
  EXPECT_EQ(field[0].direction, Vec3f(1, 0, 0));
  EXPECT_EQ(field[0].fidelity, 1.0F);
  EXPECT_EQ(field[1].direction, Vec3f(0, -1, 0));
  EXPECT_EQ(field[1].fidelity, 0.25F);
  EXPECT_EQ(field[2].direction, Vec3f(0, 0, 0));
  EXPECT_EQ(field[3].direction, Vec3f(0, 0, 1));
  EXPECT_EQ(hash_.size(), 64U);
  const std::string hash = hash_;
  load("1 0 0\n", 1);
  EXPECT_NE(hash_, hash);
}

TEST_F(FieldReader, ManyLines) {
  std::string text;
  for (int i = 0; i < 20000; ++i) {
    text += std::to_string(i + 1) + " 0 0 " + std::to_string(i % 2) + "\n";
  }
  const auto field = load(text, 20000);
  ASSERT_EQ(field.size(), 20000U);
  for (std::size_t i = 0; i < field.size(); ++i) {
    EXPECT_EQ(field[i].direction, Vec3f(1, 0, 0));
    EXPECT_EQ(field[i].fidelity, static_cast<float>(i % 2));
  }
}

TEST_F(FieldReader, WhatIsWrongIsNamed) {
  const struct {
    const char* text;
    const char* said;
  } cases[] = {
      {"1 0 0\n", "it has 1 vectors, but the scan file has 2 vertices"},
      {"1 0 0\n1 0 0\n1 0 0\n", "it has 3 vectors, but the scan file has 2 vertices"},
      {"", "it has 0 vectors"},
      {"1 0 0\n1 0\n", "line 2"},
      {"1 0 0\nnan 0 0\n", "line 2"},
      {"1 0 0\n0 1e999 0\n", "line 2"},
      {"1 x 0\n", "line 1"},
      {"1 0 0 2\n", "fidelity"},
      {"1 0 0 -0.1\n", "fidelity"},
      {"1 0 0 1 1\n", "more than four"},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(c.text);
    try {
      load(c.text, 2);
      FAIL() << "no error";
    } catch (const InputError& e) {
      EXPECT_THAT(e.what(), HasSubstr(path_));
      EXPECT_THAT(e.what(), HasSubstr(c.said));
    }
  }
  EXPECT_THROW(read_field("/no/such/file", 1, [](auto) {}), InputError);
}

}  // namespace
}  // namespace rattan
