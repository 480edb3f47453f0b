// SPDX-License-Identifier: MIT
#pragma once

// Names of files are any bytes, a text of JSON is not: a name that is no UTF-8 goes beside its
// readable form as hexadecimal digits, under the same key with "_hex".

#include <string>
#include <string_view>

namespace rattan {

/// Whether the text is valid UTF-8: shortest forms of Unicode scalar values.
bool is_utf8(std::string_view text);

/// Two digits a byte.
std::string to_hex(std::string_view bytes);
/// Of to_hex(); what isn't a pair of digits counts as zero.
std::string from_hex(std::string_view digits);

}  // namespace rattan
