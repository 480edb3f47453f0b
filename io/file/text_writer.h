// SPDX-License-Identifier: MIT
#pragma once

// Text and numbers into a file; internal to io/. Numbers are the shortest that read back the same.

#include <charconv>
#include <cstddef>
#include <string_view>

#include "engine/core/types.h"

namespace rattan {

/// `Out` has write(std::string_view), as AtomicFile has.
template <class Out>
class TextWriter {
 public:
  explicit TextWriter(Out& out) : out_(out) {}
  void text(std::string_view s) { out_.write(s); }
  template <class Number>
  void number(Number value) {
    char digits[32];
    const auto end = std::to_chars(digits, digits + sizeof(digits), value).ptr;
    out_.write(std::string_view(digits, static_cast<std::size_t>(end - digits)));
  }
  void point(const Vec3d& p) {
    for (int k = 0; k < 3; ++k) {
      text(k == 0 ? "" : " ");
      number(p[k]);
    }
  }

 private:
  Out& out_;
};

}  // namespace rattan
