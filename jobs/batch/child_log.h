// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace rattan {

/// What a child says while it works: lines of `rattan remesh --log-format json`, and whatever a
/// library or the system says besides. Kept as text for people, within bounds.
class ChildLog {
 public:
  /// True if the line is an event, which is put into `event` then.
  bool take(std::string_view line, nlohmann::json& event);

  /// The last error; else the last thing that was said outside events.
  std::string sentence() const;
  std::uint64_t warnings() const { return warnings_; }
  /// As the child states it; 0 if it didn't.
  std::uint64_t peak_rss_bytes() const { return peak_rss_bytes_; }
  std::string text() const;

 private:
  void keep(std::string line);

  std::string head_;
  std::string tail_;
  std::uint64_t dropped_ = 0;
  std::string error_;
  std::string said_;
  std::uint64_t warnings_ = 0;
  std::uint64_t peak_rss_bytes_ = 0;
};

}  // namespace rattan
