// SPDX-License-Identifier: MIT
#pragma once

// OBJ files as statements: lines, joined where a backslash at the end continues them.

#include <cstddef>
#include <string>
#include <string_view>

#include "io/file/byte_source.h"

namespace rattan {

class ObjStatements {
 public:
  /// `source` and `remedy`, for what fails, outlive this.
  ObjStatements(ByteSource& source, const char* remedy) : source_(source), remedy_(remedy) {}

  /// False at the end of the file. The view holds until the next call. Throws InputError for a
  /// statement of more than 16 MiB.
  bool next(std::string_view& line);

 private:
  static constexpr std::size_t kMaxStatement = std::size_t{16} << 20;

  ByteSource& source_;
  const char* remedy_;
  std::string joined_;
};

}  // namespace rattan
