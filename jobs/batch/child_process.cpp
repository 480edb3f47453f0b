// SPDX-License-Identifier: MIT
#include "jobs/batch/child_process.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace rattan {

namespace {

constexpr std::size_t kMostLine = std::size_t{1} << 20;
constexpr std::size_t kStackBytes = 65536;

struct Launch {
  const char* path = nullptr;
  char* const* words = nullptr;
  int errors = -1;
  int nothing = -1;
  pid_t parent = 0;
  sigset_t mask{};
  int problem = 0;  ///< errno, written by the child into the shared memory
};

// Runs in the child, in the parent's memory: system calls only. The parent sleeps until exec.
int launch(void* argument) {
  auto& how = *static_cast<Launch*>(argument);
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (::getppid() != how.parent) {  // it died before the request
    ::_exit(127);
  }
  struct sigaction action {};
  for (const int signal : {SIGTERM, SIGINT, SIGUSR1, SIGUSR2, SIGCHLD, SIGHUP}) {
    action.sa_handler = SIG_DFL;
    ::sigaction(signal, &action, nullptr);
  }
  action.sa_handler = SIG_IGN;
  ::sigaction(SIGPIPE, &action, nullptr);
  ::dup2(how.nothing, 0);
  ::dup2(how.nothing, 1);
  ::dup2(how.errors, 2);
  ::sigprocmask(SIG_SETMASK, &how.mask, nullptr);
  ::execv(how.path, how.words);
  how.problem = errno;
  ::_exit(127);
}

double seconds(const timeval& t) {
  return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
}

}  // namespace

ChildProcess::ChildProcess(const std::vector<std::string>& command, bool same_program) {
  const auto fail = [&](int error) {
    throw NoProcess(command[0] + ": no process can be started (" + std::strerror(error) +
                    "). End others, or allow more with ulimit.");
  };
  std::array<int, 2> pipe{};
  if (::pipe2(pipe.data(), O_CLOEXEC) != 0) {
    fail(errno);
  }
  ::fcntl(pipe[0], F_SETFL, O_NONBLOCK);
  const int nothing = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  std::vector<char*> words;
  words.reserve(command.size() + 1);
  for (const std::string& word : command) {
    words.push_back(const_cast<char*>(word.c_str()));
  }
  words.push_back(nullptr);
  Launch how;
  // The file may have been replaced by a newer one, which must not be mixed in.
  how.path = same_program ? "/proc/self/exe" : command[0].c_str();
  how.words = words.data();
  how.errors = pipe[1];
  how.nothing = nothing;
  how.parent = ::getpid();
  // No handler may run in the child while the memory is shared.
  sigset_t all{};
  sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, &how.mask);
  const sigset_t before = how.mask;
  for (const int signal : {SIGTERM, SIGINT, SIGUSR1, SIGUSR2, SIGCHLD, SIGHUP, SIGPIPE}) {
    sigdelset(&how.mask, signal);
  }
  std::vector<char> stack(kStackBytes);
  char* top = stack.data() + (stack.size() & ~std::size_t{15});
  top -= reinterpret_cast<std::uintptr_t>(top) & 15U;
  pid_ = ::clone(launch, top, CLONE_VM | CLONE_VFORK | SIGCHLD, &how);
  const int error = pid_ < 0 ? errno : how.problem;
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  ::close(pipe[1]);
  ::close(nothing);
  errors_ = pipe[0];
  if (error != 0) {
    ::close(errors_);
    if (pid_ > 0) {
      ::waitpid(pid_, nullptr, 0);
    }
    fail(error);
  }
}

ChildProcess::~ChildProcess() {
  if (errors_ >= 0) {
    ::close(errors_);
  }
  if (!ended_) {
    send(SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
}

void ChildProcess::send(int signal) const {
  if (!ended_) {
    ::kill(pid_, signal);
  }
}

void ChildProcess::read_lines(const Lines& lines) {
  std::array<char, 16384> bytes{};
  while (errors_ >= 0) {
    const ssize_t got = ::read(errors_, bytes.data(), bytes.size());
    if (got < 0 && errno == EINTR) {
      continue;
    }
    if (got < 0 && errno == EAGAIN) {
      return;
    }
    if (got <= 0) {
      ::close(errors_);
      errors_ = -1;
      break;
    }
    std::string_view rest(bytes.data(), static_cast<std::size_t>(got));
    for (std::size_t end = rest.find('\n'); end != std::string_view::npos; end = rest.find('\n')) {
      line_.append(rest.substr(0, end));
      lines(line_);
      line_.clear();
      rest.remove_prefix(end + 1);
    }
    if (line_.size() < kMostLine) {
      line_.append(rest);
    }
  }
  if (!line_.empty()) {
    lines(line_);
    line_.clear();
  }
}

bool ChildProcess::reap(const Lines& lines) {
  if (ended_) {
    return true;
  }
  struct rusage used {};
  if (::wait4(pid_, &status_, WNOHANG, &used) != pid_) {
    return false;
  }
  ended_ = true;
  cpu_seconds_ = seconds(used.ru_utime) + seconds(used.ru_stime);
  peak_rss_bytes_ = static_cast<std::uint64_t>(used.ru_maxrss) * 1024U;
  read_lines(lines);
  if (!line_.empty()) {
    lines(line_);
    line_.clear();
  }
  return true;
}

bool ChildProcess::was_signalled() const {
  return WIFSIGNALED(status_);
}
int ChildProcess::exit_code() const {
  return WEXITSTATUS(status_);
}
int ChildProcess::signal() const {
  return WTERMSIG(status_);
}

std::string shell_command(const std::vector<std::string>& command) {
  std::string line;
  for (const std::string& word : command) {
    const bool plain =
        !word.empty() && word.find_first_not_of(
                             "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                             "_-+=./:,@%") == std::string::npos;
    line += line.empty() ? "" : " ";
    if (plain) {
      line += word;
      continue;
    }
    line += '\'';
    for (const char c : word) {
      line += c == '\'' ? std::string("'\\''") : std::string(1, c);
    }
    line += '\'';
  }
  return line;
}

}  // namespace rattan
