// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <chrono>
#include <csignal>
#include <functional>
#include <stop_token>
#include <thread>

namespace rattan {

/// While it lives, SIGTERM, SIGINT and SIGUSR1 ask to stop: soon() at once, now() some seconds
/// later, and if the process is still there after some more (in a step that nothing can interrupt),
/// it ends with exit code 75. What is on disk is whole at any instant. A second signal ends it at
/// once; those within two seconds of the first are taken for the same. Made before any other thread
/// is. `say` is told each, in the watcher's thread; the default writes to stderr.
class Interruption {
 public:
  enum class Moment { kStopping, kLeaving };
  using Say = std::function<void(Moment, const char* sentence)>;

  explicit Interruption(Say say = {});
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  std::stop_token soon() const { return soon_.get_token(); }
  std::stop_token now() const { return now_.get_token(); }

 private:
  void watch();
  [[noreturn]] void leave();
  int next_signal(const std::chrono::steady_clock::time_point* until);

  Say say_;
  sigset_t signals_{};
  sigset_t before_{};
  std::stop_source soon_;
  std::stop_source now_;
  std::atomic<bool> ending_ = false;
  std::jthread watcher_;
};

}  // namespace rattan
