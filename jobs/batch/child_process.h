// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <sys/types.h>
#include <vector>

#include "engine/core/errors.h"

namespace rattan {

/// The system starts no more processes.
class NoProcess : public ResourceError {
 public:
  using ResourceError::ResourceError;
};

/// A program that runs beside this one, in a process group of its own, with nothing on its input,
/// its output thrown away and its errors in a pipe. It gets SIGTERM when this process dies, however
/// that happens, and doesn't die of the broken pipe then.
class ChildProcess {
 public:
  /// Starts `command[0]`, or the program of this process if `same_program`. Must be called on the
  /// thread that lives longest: the kernel takes its end for that of the process. Throws
  /// NoProcess.
  ChildProcess(const std::vector<std::string>& command, bool same_program);
  /// Kills it if it still runs.
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  pid_t pid() const { return pid_; }
  /// To be polled for reading; -1 after its end.
  int errors() const { return errors_; }
  void send(int signal) const;

  using Lines = std::function<void(std::string_view)>;
  /// Hands out what lines there are, without waiting. A line beyond 1 MiB is cut.
  void read_lines(const Lines& lines);
  /// True once it has ended; then all its lines have been handed out.
  bool reap(const Lines& lines);

  // After reap() said so:
  bool was_signalled() const;
  int exit_code() const;
  int signal() const;
  double cpu_seconds() const { return cpu_seconds_; }
  std::uint64_t peak_rss_bytes() const { return peak_rss_bytes_; }

 private:
  pid_t pid_ = -1;
  int errors_ = -1;
  bool ended_ = false;
  int status_ = 0;
  double cpu_seconds_ = 0.0;
  std::uint64_t peak_rss_bytes_ = 0;
  std::string line_;  ///< begun
};

/// As a shell takes it, on one line.
std::string shell_command(const std::vector<std::string>& command);

}  // namespace rattan
