// SPDX-License-Identifier: MIT
#pragma once

// Patterns that choose files by name.

#include <string>
#include <string_view>
#include <vector>

namespace rattan {

/// Whether the whole of `path` fits the pattern: * stands for any characters but '/', ? for one of
/// these (a character of UTF-8), [a-z] and [!a-z] for one in or not in the set, ** for any
/// characters with '/', **/ also for nothing, \ takes the next one literally.
bool glob_match(std::string_view pattern, std::string_view path);

/// What --include and --exclude say of paths below a folder. A pattern without '/' is about names
/// at any depth, one with '/' about the path. One that fits a folder means all that is in it.
class PathFilter {
 public:
  PathFilter() = default;
  PathFilter(const std::vector<std::string>& include, const std::vector<std::string>& exclude);

  /// Whether the file at this path, relative and with '/', is chosen.
  bool takes(std::string_view path) const;
  /// Whether nothing in this folder can be chosen.
  bool skips_folder(std::string_view path) const;

 private:
  std::vector<std::string> include_;
  std::vector<std::string> exclude_;
};

}  // namespace rattan
