// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <string>

namespace rattan {

inline constexpr int kExitDone = 0;
inline constexpr int kExitDefect = 1;
inline constexpr int kExitUsage = 2;
inline constexpr int kExitInput = 3;
inline constexpr int kExitResource = 4;
inline constexpr int kExitInterrupted = 75;

/// Told the sentence and the exit code of an error that ends a command.
using ErrorSink = std::function<void(const std::string&, int)>;

/// Writes the sentence to stderr.
void say_error(const std::string& sentence, int code);

/// Runs a command, says what went wrong, and returns the exit code for it.
int run_guarded(const std::function<int()>& command, const ErrorSink& say = say_error);

}  // namespace rattan
