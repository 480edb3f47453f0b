// SPDX-License-Identifier: MIT
#pragma once

// Sizes as people write them: "50k,10k,2k".

#include <string>
#include <string_view>
#include <vector>

namespace rattan {

struct SizeRange {
  double least = 0.0;
  double most = 0.0;
};

/// Numbers separated by commas, each with an optional suffix k (thousand) or M (million). Throws
/// UsageError that names `option` and the part that isn't a number or isn't in the range.
std::vector<double> parse_sizes(std::string_view text, std::string_view option, SizeRange range);

/// The number in full, without exponent or needless digits: 50000, 0.05. For names of files.
std::string size_text(double size);

}  // namespace rattan
