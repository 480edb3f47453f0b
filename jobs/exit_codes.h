// SPDX-License-Identifier: MIT
#pragma once

namespace rattan {

/// How commands end, as their callers see it: scripts, batches, schedulers.
inline constexpr int kExitDone = 0;
inline constexpr int kExitDefect = 1;
inline constexpr int kExitUsage = 2;
inline constexpr int kExitInput = 3;
inline constexpr int kExitResource = 4;
inline constexpr int kExitInterrupted = 75;

}  // namespace rattan
