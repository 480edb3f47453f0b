// SPDX-License-Identifier: MIT
#include "jobs/size_list.h"

#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "engine/core/errors.h"

namespace rattan {

namespace {

double parse_size(std::string_view part, std::string_view option, SizeRange range) {
  std::string_view digits = part;
  double factor = 1.0;
  if (!digits.empty() && (digits.back() == 'k' || digits.back() == 'M')) {
    factor = digits.back() == 'k' ? 1e3 : 1e6;
    digits.remove_suffix(1);
  }
  double value = 0.0;
  const char* end = digits.data() + digits.size();
  const auto [stop, error] = std::from_chars(digits.data(), end, value);
  if (error != std::errc() || stop != end || !std::isfinite(value)) {
    throw UsageError(fmt::format(
        "{}: '{}' is not a size. Write numbers like 20000, 20k or 1.5M, separated by commas.",
        option, part));
  }
  value *= factor;
  if (!(value >= range.least && value <= range.most)) {
    throw UsageError(fmt::format("{}: {} is out of range; it takes {} to {}.", option, part,
                                 size_text(range.least), size_text(range.most)));
  }
  return value;
}

}  // namespace

std::vector<double> parse_sizes(std::string_view text, std::string_view option, SizeRange range) {
  std::vector<double> sizes;
  for (;;) {
    const std::size_t comma = text.find(',');
    sizes.push_back(parse_size(text.substr(0, comma), option, range));
    if (comma == std::string_view::npos) {
      return sizes;
    }
    text.remove_prefix(comma + 1);
  }
}

std::string size_text(double size) {
  char text[512];
  const auto [end, error] = std::to_chars(text, text + sizeof text, size, std::chars_format::fixed);
  return error == std::errc() ? std::string(text, end) : fmt::format("{}", size);
}

}  // namespace rattan
