// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

#include "io/file/text_writer.h"
#include "io/remesh/remesh_metadata.h"

namespace rattan {

/// Line breaks become spaces.
inline std::string one_line(std::string text) {
  for (char& c : text) {
    c = c == '\n' || c == '\r' ? ' ' : c;
  }
  return text;
}

/// A comment line for each of version, options and input that is known; `lead` begins it.
template <class Out>
void write_comments(TextWriter<Out>& line, std::string_view lead, const RemeshMetadata& metadata) {
  const auto put = [&](std::string_view name, const std::string& value) {
    if (!value.empty()) {
      line.text(lead);
      line.text(name);
      line.text(one_line(value));
      line.text("\n");
    }
  };
  put("", metadata.version.empty() ? "rattan" : "rattan " + metadata.version);
  put("options ", metadata.options);
  put("input sha256 ", metadata.input_hash);
}

}  // namespace rattan
