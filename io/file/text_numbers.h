// SPDX-License-Identifier: MIT
#pragma once

// Numbers and words in a line of text; internal to io/.

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

namespace rattan {

/// Walks the blank-separated words of one line.
class TextLine {
 public:
  explicit TextLine(std::string_view line) : p_(line.data()), end_(line.data() + line.size()) {}

  bool at_end() {
    skip_blanks();
    return p_ == end_;
  }
  char peek() const { return *p_; }

  /// Next word; empty at the end of the line.
  std::string_view word() {
    skip_blanks();
    const char* begin = p_;
    end_word();
    return {begin, static_cast<std::size_t>(p_ - begin)};
  }
  /// Passes what is left of a word that a number was read from.
  void end_word() {
    while (p_ != end_ && !is_blank(*p_)) {
      ++p_;
    }
  }
  /// False, without moving, if the next word is not a number. Correctly rounded.
  bool number(double& value) {
    skip_blanks();
    const char* p = p_;
    const bool negative = p != end_ && *p == '-';
    if (p != end_ && (*p == '-' || *p == '+')) {
      ++p;
    }
    // Up to 19 digits and a power of ten up to 22: one exact product or quotient (Clinger).
    std::uint64_t digits = 0;
    int count = 0;
    int exponent = 0;
    for (; p != end_ && is_digit(*p); ++p, ++count) {
      digits = digits * 10 + static_cast<std::uint64_t>(*p - '0');
    }
    if (p != end_ && *p == '.') {
      const char* point = ++p;
      for (; p != end_ && is_digit(*p); ++p, ++count) {
        digits = digits * 10 + static_cast<std::uint64_t>(*p - '0');
      }
      exponent = -static_cast<int>(std::min<std::ptrdiff_t>(p - point, 1000));
    }
    if (count == 0 || count > 19 || (p != end_ && !is_blank(*p)) || exponent < -22 ||
        digits > (std::uint64_t{1} << 53)) {
      return general_number(value);
    }
    const double magnitude = static_cast<double>(digits) / kPowerOfTen[-exponent];
    value = negative ? -magnitude : magnitude;
    p_ = p;
    return true;
  }
  /// False, without moving, if the next word is not an integer; `stop` may end it, e.g. '/'.
  bool integer(std::int64_t& value, char stop = ' ') {
    skip_blanks();
    const char* p = p_;
    if (p != end_ && *p == '+') {
      ++p;
    }
    const auto [rest, error] = std::from_chars(p, end_, value);
    if (error != std::errc() || (rest != end_ && !is_blank(*rest) && *rest != stop)) {
      return false;
    }
    p_ = rest;
    return true;
  }

 private:
  static bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
  }
  static bool is_digit(char c) { return static_cast<unsigned char>(c - '0') < 10; }
  void skip_blanks() {
    while (p_ != end_ && is_blank(*p_)) {
      ++p_;
    }
  }
  bool general_number(double& value) {
    const char* p = p_;
    if (p != end_ && *p == '+') {
      ++p;
    }
    auto [rest, error] = std::from_chars(p, end_, value);
    if (error == std::errc::invalid_argument || (rest != end_ && !is_blank(*rest))) {
      return false;
    }
    if (error == std::errc::result_out_of_range) {
      value = std::strtod(std::string(p, rest).c_str(), nullptr);  // infinity or zero
    }
    p_ = rest;
    return true;
  }

  static constexpr double kPowerOfTen[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                           1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                           1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
  const char* p_;
  const char* end_;
};

/// Whether a word is the given one (in lower case), in whatever case.
inline bool same_word(std::string_view word, std::string_view lower) {
  return word.size() == lower.size() &&
         std::equal(word.begin(), word.end(), lower.begin(), [](char a, char b) {
           return a == b || (a >= 'A' && a <= 'Z' && a - 'A' + 'a' == b);
         });
}

/// A word as it may appear in a message: quoted, cut short, without control characters.
inline std::string quoted(std::string_view word) {
  std::string text = "\"";
  for (const char c : word.substr(0, 40)) {
    text += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '?' : c;
  }
  return text + (word.size() > 40 ? "...\"" : "\"");
}

}  // namespace rattan
