// SPDX-License-Identifier: MIT
#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "jobs/batch/batch_item.h"

namespace rattan {

/// A folder of its own, deleted at the end.
class BatchFixture : public ::testing::Test {
 protected:
  BatchFixture() {
    std::string name = (std::filesystem::temp_directory_path() / "rattan-batch-XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
  }
  ~BatchFixture() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::string write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return path(name);
  }
  static std::string read(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }

  /// An item for the scan as it is now.
  BatchItem item(const std::string& id, const std::string& scan,
                 const RemeshOptions& options = {}) const {
    auto what = std::make_shared<ItemOptions>();
    what->remesh = options;
    what->key = item_key(options);
    BatchItem item;
    item.id = id;
    item.scan = scan;
    item.what = what;
    const FileStamp stamp = FileStamp::of(scan);
    item.scan_bytes = stamp.bytes;
    item.scan_time = stamp.time;
    return item;
  }

  std::filesystem::path folder_;
};

}  // namespace rattan
