// SPDX-License-Identifier: MIT
#include "jobs/batch/claims.h"

#include <filesystem>
#include <unistd.h>
#include <utility>

namespace rattan {

namespace fs = std::filesystem;

namespace {

std::string claims_folder(const std::string& directory) {
  return (fs::path(directory) / ".rattan" / "claims").string();
}

}  // namespace

Claim::Claim(std::string root, const std::string& folder)
    : root_(std::move(root)), folder_(folder) {
  lock_.emplace(folder_);
}

std::unique_ptr<Claim> Claim::take(const std::string& directory, const std::string& id) {
  std::string root = claims_folder(directory);
  const std::string folder = (fs::path(root) / id).string();
  try {
    return std::unique_ptr<Claim>(new Claim(std::move(root), folder));
  } catch (const DirectoryInUse&) {
    return nullptr;
  }
}

Claim::~Claim() {
  lock_.reset();
  // Folders of the id that are empty now; another process may be making one in them, and tries
  // again then.
  for (fs::path at = fs::path(folder_).parent_path();
       at.native().size() > root_.size() && ::rmdir(at.c_str()) == 0; at = at.parent_path()) {
  }
}

bool Claim::left(const std::string& directory, const std::string& id) {
  std::error_code error;
  return fs::exists(fs::path(claims_folder(directory)) / id, error);
}

std::optional<std::string> Claim::holder(const std::string& directory, const std::string& id) {
  return WorkLock::holder(fs::path(claims_folder(directory)) / id);
}

bool work_in_use(const std::string& work_directory) {
  std::error_code error;
  if (!fs::is_directory(work_directory, error)) {
    return false;
  }
  return WorkLock::holder(work_directory).has_value();
}

}  // namespace rattan
