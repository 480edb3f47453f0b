// SPDX-License-Identifier: MIT
// Every byte of a small checkpoint, changed one at a time: it is noticed, or what is read is right.

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "io/store/hdf5_store.h"
#include "tests/io/store/random_chunk.h"

namespace rattan {
namespace {

namespace fs = std::filesystem;

using test::chunk;

struct Expected {
  std::string field;
  std::uint32_t tile;
  std::uint32_t seed;
  std::size_t size;
};

std::string content(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

class StoreDamageTest : public ::testing::Test {
 protected:
  StoreDamageTest() {
    std::string name = (fs::temp_directory_path() / "rattan_damage_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) {
      throw std::runtime_error("no temporary directory");
    }
    base_ = name;
    make();
  }
  ~StoreDamageTest() override { fs::remove_all(base_); }

  fs::path work() const { return base_ / "work"; }
  Hdf5StoreOptions options(bool read_only = false) const {
    return {.directory = work(), .cache_bytes = 1 << 20, .keep = true, .read_only = read_only};
  }

  // Two checkpoints, so that there are files of both and a field in more than one.
  void make() {
    Hdf5Store store(options());
    const auto write = [&](const char* field, std::uint32_t tile, std::uint32_t seed,
                           std::size_t size) {
      store.write_chunk(field, TileId(tile), chunk(seed, size));
      std::erase_if(expected_,
                    [&](const Expected& e) { return e.field == field && e.tile == tile; });
      expected_.push_back({field, tile, seed, size});
    };
    write("mesh/x", 0, 1, 150);
    write("mesh/x", 1, 2, 90);
    write("mesh/empty", 0, 3, 0);
    write("mesh/y", 0, 4, 60);
    store.set_note("options", "--faces 500");
    store.checkpoint();
    store.settle();
    write("mesh/x", 1, 5, 90);
    write("mesh/z", 7, 6, 33);
    store.set_note("options", "--faces 500");
    store.checkpoint();
    store.settle();
  }

  /// What a run sees of the directory as it is now; `named` must be in every complaint.
  enum class Outcome { kNoticed, kRight, kWrong };
  Outcome look(const std::string& named, std::string& said, bool read_only = false) const {
    try {
      Hdf5Store store(options(read_only));
      for (const std::string& sentence : store.damage()) {
        said = sentence;
      }
      bool all = true;
      for (const Expected& e : expected_) {
        if (!store.has_chunk(e.field, TileId(e.tile))) {
          all = false;
        } else if (*store.read_chunk(e.field, TileId(e.tile)) != *chunk(e.seed, e.size)) {
          return Outcome::kWrong;
        }
      }
      const auto note = store.note("options");
      all = all && note == "--faces 500";
      if (note && note != "--faces 500") {
        return Outcome::kWrong;
      }
      if (!said.empty()) {
        return said.find(named) != std::string::npos ? Outcome::kNoticed : Outcome::kWrong;
      }
      return all ? Outcome::kRight : Outcome::kWrong;  // nothing may go without a word
    } catch (const InputError& e) {
      said = e.what();
      return said.find(named) != std::string::npos ? Outcome::kNoticed : Outcome::kWrong;
    }
  }

  using Files = std::map<fs::path, std::string>;

  /// What was damaged may have been deleted, and what it makes useless, the directory with the last
  /// of it.
  void restore(const Files& whole, const fs::path& damaged) const {
    fs::create_directory(work());
    for (const auto& [path, bytes] : whole) {
      if (path == damaged || !fs::exists(path)) {
        std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
      }
    }
  }

  Files files() const {
    Files result;
    for (const auto& entry : fs::directory_iterator(work())) {
      result[entry.path()] = content(entry.path());
    }
    return result;
  }

  fs::path base_;
  std::vector<Expected> expected_;
};

/// Offsets of all bytes that hold something, of the zeros beside them, and of some in the wide
/// spaces that HDF5 leaves empty.
std::vector<std::size_t> telling_offsets(const std::string& bytes) {
  constexpr std::size_t kBeside = 4;
  constexpr std::size_t kStep = 4999;
  std::vector<std::size_t> offsets;
  std::size_t known = 0;  // all below is in the list or empty
  const auto add_up_to = [&](std::size_t end) {
    for (; known < std::min(end, bytes.size()); ++known) {
      offsets.push_back(known);
    }
  };
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    if (bytes[at] != 0 || at % kStep == 0) {
      known = std::max(known, at - std::min(at, kBeside));
      add_up_to(at + kBeside);
    }
  }
  return offsets;
}

TEST_F(StoreDamageTest, EveryByteIsGuardedOrMeansNothing) {
  const Files whole = files();
  ASSERT_EQ(whole.size(), 3U);
  std::string said;
  ASSERT_EQ(look("", said), Outcome::kRight) << said;
  for (const auto& [path, bytes] : whole) {
    const std::string name = path.filename().string();
    std::size_t noticed = 0;
    const std::vector<std::size_t> offsets = telling_offsets(bytes);
    for (const std::size_t at : offsets) {
      const auto put = [&](int byte) {
        std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
        file.seekp(static_cast<std::streamoff>(at));
        file.put(static_cast<char>(byte));
      };
      put(bytes[at] ^ (1 << at % 8));
      said.clear();
      // Looking alone deletes nothing, which is faster; now and then as a run would.
      const bool look_alone = at % 16 != 0;
      const Outcome outcome = look(name, said, look_alone);
      noticed += outcome == Outcome::kNoticed ? 1 : 0;
      ASSERT_NE(outcome, Outcome::kWrong) << name << ", byte " << at << ": " << said;
      if (look_alone) {
        put(bytes[at]);
      } else {
        restore(whole, path);
      }
    }
    RecordProperty(path.stem().string(),
                   std::to_string(noticed) + " of " + std::to_string(offsets.size()));
    EXPECT_GT(noticed, offsets.size() / 4) << name;
  }
}

TEST_F(StoreDamageTest, EveryLengthIsNoticedOrTheDataIsThere) {
  const Files whole = files();
  for (const auto& [path, bytes] : whole) {
    const std::string name = path.filename().string();
    const std::vector<std::size_t> offsets = telling_offsets(bytes);
    for (std::size_t k = 0; k < offsets.size(); k += 7) {
      fs::resize_file(path, offsets[k]);
      std::string said;
      ASSERT_NE(look(name, said), Outcome::kWrong)
          << name << ", " << offsets[k] << " bytes: " << said;
      restore(whole, path);
    }
  }
}

TEST_F(StoreDamageTest, AnotherFileUnderTheNameIsNoticed) {
  const Files whole = files();
  for (const auto& [path, bytes] : whole) {
    for (const auto& [other, others] : whole) {
      if (path == other) {
        continue;
      }
      std::ofstream(path, std::ios::binary | std::ios::trunc) << others;
      std::string said;
      EXPECT_EQ(look(path.filename().string(), said), Outcome::kNoticed)
          << other << " as " << path << ": " << said;
      restore(whole, path);
    }
    fs::remove(path);
    std::string said;
    const Outcome outcome = look(path.filename().string(), said);
    // Without the record there is no checkpoint to miss anything.
    EXPECT_TRUE(outcome == Outcome::kNoticed || path.filename() == "checkpoint") << said;
    restore(whole, path);
  }
}

}  // namespace
}  // namespace rattan
