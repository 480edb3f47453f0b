// SPDX-License-Identifier: MIT

// Every truncation and thousands of byte changes of small files: reading them either succeeds with
// indices in range or throws InputError, within memory that the file's size bounds.

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "tests/io/scan/scan_files.h"

namespace rattan {
namespace {

using testing::TemporaryFile;

// Fails rather than keep more than the file can justify.
struct CheckingSink final : ScanSink {
  explicit CheckingSink(std::size_t file_bytes) : limit(file_bytes) {}
  void add_vertices(std::span<const Vec3d> positions) override {
    vertices += positions.size();
    EXPECT_LE(vertices, limit);
  }
  void add_triangles(std::span<const std::array<std::uint64_t, 3>> block) override {
    triangles += block.size();
    EXPECT_LE(triangles, limit);
    for (const auto& t : block) {
      highest = std::max({highest, t[0], t[1], t[2]});
    }
  }
  std::size_t limit;
  std::size_t vertices = 0;
  std::size_t triangles = 0;
  std::uint64_t highest = 0;
};

bool survives(const TemporaryFile& file, const std::string& bytes) {
  file.rewrite(bytes);
  CheckingSink sink(bytes.size());
  try {
    read_scan(file.path(), sink, nullptr, {64, 8});
  } catch (const InputError&) {
    return false;
  }
  EXPECT_GT(sink.triangles, 0U);
  EXPECT_LT(sink.highest, sink.vertices);
  return true;
}

std::vector<std::pair<std::string, std::string>> seeds() {
  using namespace testing;
  return {{"m_ascii.ply", ascii_ply()},
          {"m_little.ply", plain_binary_ply(false)},
          {"m_big.ply", plain_binary_ply(true)},
          {"m_rich.ply", rich_binary_ply<double, std::uint64_t>(true, "double", "uint64")},
          {"m.obj", obj()},
          {"m.off", off()}};
}

TEST(ScanMutation, EveryTruncationIsToldOrRead) {
  for (const auto& [name, bytes] : seeds()) {
    SCOPED_TRACE(name);
    const TemporaryFile file(name);
    ASSERT_TRUE(survives(file, bytes));
    for (std::size_t length = 0; length < bytes.size(); ++length) {
      const bool read = survives(file, bytes.substr(0, length));
      // Formats that declare their counts can't be cut short unnoticed but for closing characters.
      if (read && !name.ends_with(".obj")) {
        EXPECT_GE(length + 20, bytes.size());
      }
    }
  }
}

TEST(ScanMutation, EveryByteChangeIsToldOrRead) {
  for (const auto& [name, bytes] : seeds()) {
    SCOPED_TRACE(name);
    const TemporaryFile file(name);
    std::uint64_t state = 12345;
    const auto random = [&state] {
      state = state * 6364136223846793005U + 1442695040888963407U;
      return state >> 33;
    };
    for (std::size_t at = 0; at < bytes.size(); ++at) {
      static constexpr char kPatterns[] = {'\0', '\xff', '9', '-', '\n'};
      for (const char pattern : kPatterns) {
        std::string changed = bytes;
        changed[at] = pattern;
        survives(file, changed);
      }
    }
    for (int round = 0; round < 1000; ++round) {
      std::string changed = bytes;
      for (std::uint64_t k = random() % 4 + 1; k > 0; --k) {
        const std::size_t at = random() % changed.size();
        switch (random() % 3) {
          case 0:
            changed[at] = static_cast<char>(random());
            break;
          case 1:
            changed.erase(at, random() % 8 + 1);
            break;
          default:
            changed.insert(at, changed.substr(random() % changed.size(), random() % 8 + 1));
            break;
        }
        if (changed.empty()) {
          break;
        }
      }
      survives(file, changed);
    }
  }
}

}  // namespace
}  // namespace rattan
