// SPDX-License-Identifier: MIT
#include "io/scan/obj_statements.h"

namespace rattan {

bool ObjStatements::next(std::string_view& line) {
  if (!source_.next_line(line)) {
    return false;
  }
  if (line.empty() || line.back() != '\\') {
    return true;
  }
  joined_.clear();
  do {
    joined_.append(line.substr(0, line.size() - 1));
    joined_ += ' ';
    if (joined_.size() > kMaxStatement) {
      source_.fail_at_line("a continued statement is longer than 16 MiB", remedy_);
    }
    if (!source_.next_line(line)) {
      line = {};
      break;
    }
  } while (!line.empty() && line.back() == '\\');
  joined_.append(line);
  line = joined_;
  return true;
}

}  // namespace rattan
