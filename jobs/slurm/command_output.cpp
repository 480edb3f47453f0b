// SPDX-License-Identifier: MIT
#include "jobs/slurm/command_output.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "engine/core/errors.h"

extern char** environ;

namespace rattan {

namespace {

[[noreturn]] void fail(const std::string& program, int error) {
  throw ResourceError("Can't run " + program + ": " + std::strerror(error) + ".");
}

/// The two ends of a pipe, closed at the latest here.
class Pipe {
 public:
  explicit Pipe(const std::string& program) {
    if (::pipe2(ends_.data(), O_CLOEXEC) != 0) {
      fail(program, errno);
    }
  }
  ~Pipe() {
    close_end(0);
    close_end(1);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  int reader() const { return ends_[0]; }
  int writer() const { return ends_[1]; }
  void close_writer() { close_end(1); }

  /// Appends what is there; false at the end.
  bool read_into(std::string& text) {
    std::array<char, 65536> buffer{};
    const ssize_t got = ::read(reader(), buffer.data(), buffer.size());
    if (got > 0) {
      text.append(buffer.data(), static_cast<std::size_t>(got));
    }
    return got > 0 || (got < 0 && errno == EINTR);
  }

 private:
  void close_end(std::size_t end) {
    if (ends_.at(end) >= 0) {
      ::close(ends_.at(end));
      ends_.at(end) = -1;
    }
  }

  std::array<int, 2> ends_{-1, -1};
};

// Both at once: a program that fills one pipe while the other is waited for would hang.
void read_both(Pipe& out, Pipe& error, CommandOutput& result) {
  bool out_open = true;
  bool error_open = true;
  while (out_open || error_open) {
    std::array<pollfd, 2> wanted{pollfd{out_open ? out.reader() : -1, POLLIN, 0},
                                 pollfd{error_open ? error.reader() : -1, POLLIN, 0}};
    if (::poll(wanted.data(), wanted.size(), -1) < 0 && errno != EINTR) {
      return;
    }
    if (wanted[0].revents != 0) {
      out_open = out.read_into(result.out);
    }
    if (wanted[1].revents != 0) {
      error_open = error.read_into(result.error);
    }
  }
}

}  // namespace

CommandOutput run_command(const std::vector<std::string>& words) {
  CommandOutput result;
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (const std::string& word : words) {
    arguments.push_back(const_cast<char*>(word.c_str()));
  }
  arguments.push_back(nullptr);

  Pipe out(words.front());
  Pipe error(words.front());
  posix_spawn_file_actions_t actions{};
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, out.writer(), 1);
  posix_spawn_file_actions_adddup2(&actions, error.writer(), 2);
  pid_t pid = 0;
  const int failure =
      ::posix_spawnp(&pid, arguments.front(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failure == ENOENT || failure == EACCES) {
    return result;
  }
  if (failure != 0) {
    fail(words.front(), failure);
  }
  out.close_writer();
  error.close_writer();
  read_both(out, error, result);
  int status = 0;
  while (::waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  result.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return result;
}

}  // namespace rattan
