// SPDX-License-Identifier: MIT
#include "tools/rattan/interruption.h"

#include <cerrno>
#include <ctime>
#include <pthread.h>
#include <string>
#include <unistd.h>
#include <utility>

#include "tools/rattan/exit_code.h"

namespace rattan {

namespace {

// Of the ten seconds that are promised.
constexpr timespec kGrace{4, 0};
constexpr timespec kPatience{4, 0};
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

// 0 after the longest wait.
int Interruption::next_signal(const timespec* longest) {
  while (true) {
    const int got = longest == nullptr ? sigwaitinfo(&signals_, nullptr)
                                       : sigtimedwait(&signals_, nullptr, longest);
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
  say_(Moment::kStopping, "stopping, and saving the work. Another signal stops at once.");
  soon_.request_stop();
  for (const timespec* wait : {&kGrace, &kPatience}) {
    const int got = next_signal(wait);
    if (got == kEnd) {
      return;
    }
    if (got > 0) {
      break;
    }
    now_.request_stop();
  }
  leave();
}

}  // namespace rattan
