// SPDX-License-Identifier: MIT
#include "jobs/batch/batch_item.h"

#include <fmt/format.h>

#include "jobs/output_names.h"

namespace rattan {

FileStamp FileStamp::of(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) {
    return {};
  }
  return of(status);
}

FileStamp FileStamp::of(const struct stat& status) {
  return {static_cast<std::uint64_t>(status.st_size),
          std::int64_t{status.st_mtim.tv_sec} * 1'000'000'000 + status.st_mtim.tv_nsec};
}

std::string item_key(const RemeshOptions& options) {
  const RemeshOptions resolved = options.resolved();
  std::string key;
  for (const double size : resolved.sizes) {
    key += key.empty() ? "" : "; ";
    key += resolved.canonical(size);
  }
  if (!options.field.empty()) {
    const FileStamp field = FileStamp::of(options.field);
    key += fmt::format(" field={}@{}", field.bytes, field.time);
  }
  if (!options.preview.empty()) {
    key += " preview";
  }
  return key;
}

std::vector<std::string> item_outputs(const BatchItem& item) {
  return expand_names(item.id, item.what->remesh.size_kind, item.what->remesh.sizes);
}

}  // namespace rattan
