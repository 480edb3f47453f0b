// SPDX-License-Identifier: MIT
#include "tools/rattan/interruption.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <ctime>
#include <pthread.h>
#include <string>
#include <unistd.h>
#include <utility>

#include "tools/rattan/exit_code.h"

namespace rattan {

namespace {

using Clock = std::chrono::steady_clock;

// Of the ten seconds that are promised.
constexpr std::chrono::seconds kGrace{4};
constexpr std::chrono::seconds kPatience{4};
/// One request may come as several signals: a cluster's scheduler tells every process of a job, and
/// its parent tells a process once more.
constexpr std::chrono::seconds kSameRequest{2};
/// Ends the watcher; sent by the destructor only.
constexpr int kEnd = SIGUSR2;

void say_on_stderr(Interruption::Moment /*moment*/, const char* sentence) {
  // Not stdio: whoever is stuck may hold its lock.
  const std::string line = std::string("rattan: ") + sentence + '\n';
  [[maybe_unused]] const ssize_t ignored = ::write(2, line.data(), line.size());
}

}  // namespace

Interruption::Interruption(Say say) : say_(say ? std::move(say) : Say(say_on_stderr)) {
  sigemptyset(&signals_);
  for (const int signal : {SIGTERM, SIGINT, SIGUSR1, kEnd}) {
    sigaddset(&signals_, signal);
  }
  // Blocked in this thread and in all that it starts, so that the watcher alone takes them.
  pthread_sigmask(SIG_BLOCK, &signals_, &before_);
  watcher_ = std::jthread([this] { watch(); });
}

Interruption::~Interruption() {
  ending_ = true;
  pthread_kill(watcher_.native_handle(), kEnd);
  watcher_.join();
  pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

// 0 at the time given.
int Interruption::next_signal(const Clock::time_point* until) {
  while (true) {
    int got = 0;
    if (until == nullptr) {
      got = sigwaitinfo(&signals_, nullptr);
    } else {
      const auto left = std::max(std::chrono::nanoseconds(*until - Clock::now()), {});
      const timespec wait{left.count() / 1'000'000'000, left.count() % 1'000'000'000};
      got = sigtimedwait(&signals_, nullptr, &wait);
    }
    if (got == kEnd ? ending_.load() : got > 0) {
      return got;
    }
    if (got < 0 && errno == EAGAIN) {
      return 0;
    }
  }
}

void Interruption::leave() {
  say_(Moment::kLeaving, "Interrupted; run the same command again to resume.");
  ::_exit(kExitInterrupted);
}

void Interruption::watch() {
  if (next_signal(nullptr) == kEnd) {
    return;
  }
  say_(Moment::kStopping, "stopping, and saving the work. A later signal stops at once.");
  soon_.request_stop();
  const Clock::time_point begin = Clock::now();
  for (const Clock::time_point until : {begin + kGrace, begin + kGrace + kPatience}) {
    int got = 0;
    do {
      got = next_signal(&until);
      if (got == kEnd) {
        return;
      }
    } while (got > 0 && Clock::now() < begin + kSameRequest);
    if (got > 0) {
      break;
    }
    now_.request_stop();
  }
  leave();
}

}  // namespace rattan
