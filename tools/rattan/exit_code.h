// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <string>

#include "jobs/exit_codes.h"

namespace rattan {

/// Told the sentence and the exit code of an error that ends a command.
using ErrorSink = std::function<void(const std::string&, int)>;

/// Writes the sentence to stderr.
void say_error(const std::string& sentence, int code);

/// Runs a command, says what went wrong, and returns the exit code for it.
int run_guarded(const std::function<int()>& command, const ErrorSink& say = say_error);

}  // namespace rattan
