// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace rattan {

struct TimedCommand {
  bool started = false;          ///< false: there is no such program
  int exit = -1;                 ///< -1 for a signal
  double seconds = 0.0;          ///< wall
  double cpu_seconds = 0.0;      ///< with the processes it waited for
  std::uint64_t peak_bytes = 0;  ///< resident memory, of the largest of them

  bool ok() const { return started && exit == 0; }
};

/// Runs a program by name, its output thrown away, and waits for it.
TimedCommand time_command(std::vector<std::string> words);

}  // namespace rattan
