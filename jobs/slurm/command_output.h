// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace rattan {

/// What a program that was run left.
struct CommandOutput {
  int code = 127;  ///< exit code; 127 where the program isn't to be found, 128 + n after signal n
  std::string out;
  std::string error;
};

/// Runs a program (words[0], looked for in PATH) without a shell and waits for it. Throws
/// ResourceError where no process can be made.
CommandOutput run_command(const std::vector<std::string>& words);

/// run_command, or a stand-in in tests.
using CommandRunner = std::function<CommandOutput(const std::vector<std::string>&)>;

}  // namespace rattan
