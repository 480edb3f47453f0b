// SPDX-License-Identifier: MIT
#pragma once

#include <stop_token>

namespace rattan {

/// Requests to stop a run, which then throws Cancelled. Default: never.
struct StopRequests {
  /// At the end of the step: its work is saved.
  std::stop_token soon;
  /// At once: what the last checkpoint holds stays.
  std::stop_token now;
};

}  // namespace rattan
