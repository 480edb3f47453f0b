// SPDX-License-Identifier: MIT
#include "io/store/stage_file.h"

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <sys/syscall.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "engine/core/errors.h"
#include "tests/io/store/random_chunk.h"

namespace {

/// Which of the coming writes fails, from 1; 0: none.
int failing_write = 0;

}  // namespace

/// In place of the C library's: what HDF5 writes with.
extern "C" ssize_t pwrite(int file, const void* bytes, std::size_t size, off_t offset) {
  if (failing_write > 0 && --failing_write == 0) {
    errno = ENOSPC;
    return -1;
  }
  return ::syscall(SYS_pwrite64, file, bytes, size, offset);
}

namespace rattan {
namespace {

namespace fs = std::filesystem;

class StageFileTest : public ::testing::Test {
 protected:
  StageFileTest() {
    std::string name = (fs::temp_directory_path() / "rattan_stage_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) {
      throw std::runtime_error("no temporary directory");
    }
    base_ = name;
  }
  ~StageFileTest() override {
    failing_write = 0;
    fs::remove_all(base_);
  }

  /// Two fields of two chunks.
  void make() const {
    const auto file = StageFile::create(base_ / "made.1.h5");
    StageFile::Contents contents;
    for (const std::string field : {"first", "second"}) {
      for (std::uint32_t tile = 0; tile < 2; ++tile) {
        const auto bytes = test::chunk(tile, 3000);
        contents[field].push_back({tile, file->append(field, *bytes), bytes->size(), tile});
      }
    }
    file->seal(contents);
    file->commit();
  }

  fs::path base_;
};

TEST_F(StageFileTest, NoWriteFailsUnnoticed) {
  int failed = 0;
  for (int at = 1;; ++at) {
    failing_write = at;
    try {
      make();
    } catch (const DiskFull&) {
      EXPECT_EQ(failing_write, 0);
      ++failed;
      continue;
    }
    ASSERT_GT(failing_write, 0) << "write " << at;
    break;  // there are no more
  }
  EXPECT_GT(failed, 8);
  failing_write = 0;
  EXPECT_EQ(StageFile::open(base_ / "made.1.h5")->take_contents().size(), 2U);
}

}  // namespace
}  // namespace rattan
