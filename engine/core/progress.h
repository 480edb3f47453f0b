// SPDX-License-Identifier: MIT
#pragma once

// The one channel from the engine to its caller: progress, warnings, and the request to stop.

#include <cstdint>
#include <stop_token>
#include <string>
#include <string_view>

namespace rattan {

/// Receives progress. Called from several threads at once: implementations lock.
class ProgressSink {
 public:
  virtual ~ProgressSink() = default;
  /// `done` of `total` units of `stage` are complete.
  virtual void progress(std::string_view stage, std::uint64_t done, std::uint64_t total) = 0;
  /// A sentence worth the user's attention; also kept for the report.
  virtual void warning(const std::string& sentence) = 0;
};

/// Ignores everything; the default in tests.
class NullProgress final : public ProgressSink {
 public:
  void progress(std::string_view, std::uint64_t, std::uint64_t) override {}
  void warning(const std::string&) override {}
};

}  // namespace rattan
