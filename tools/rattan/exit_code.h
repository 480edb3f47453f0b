// SPDX-License-Identifier: MIT
#pragma once

#include <functional>

namespace rattan {

inline constexpr int kExitDone = 0;
inline constexpr int kExitDefect = 1;
inline constexpr int kExitUsage = 2;
inline constexpr int kExitInput = 3;
inline constexpr int kExitResource = 4;
inline constexpr int kExitInterrupted = 75;

/// Runs a command, says on stderr what went wrong, and returns the exit code for it.
int run_guarded(const std::function<int()>& command);

}  // namespace rattan
