// SPDX-License-Identifier: MIT
#pragma once

#include <csignal>
#include <sys/signalfd.h>
#include <unistd.h>

#include "engine/core/errors.h"

namespace rattan {

/// SIGTERM, SIGINT, SIGUSR1 and SIGCHLD as something to poll, while it lives; otherwise blocked.
class BatchSignals {
 public:
  BatchSignals() {
    sigemptyset(&set_);
    for (const int signal : {SIGTERM, SIGINT, SIGUSR1, SIGCHLD}) {
      sigaddset(&set_, signal);
    }
    ::pthread_sigmask(SIG_BLOCK, &set_, &before_);
    descriptor_ = ::signalfd(-1, &set_, SFD_CLOEXEC | SFD_NONBLOCK);
    ensure(descriptor_ >= 0, "signals can be read");
  }
  BatchSignals(const BatchSignals&) = delete;
  BatchSignals& operator=(const BatchSignals&) = delete;
  ~BatchSignals() {
    ::close(descriptor_);
    ::pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  int descriptor() const { return descriptor_; }
  /// 0 if there is none.
  int next() const {
    signalfd_siginfo info{};
    return ::read(descriptor_, &info, sizeof(info)) == sizeof(info)
               ? static_cast<int>(info.ssi_signo)
               : 0;
  }

 private:
  sigset_t set_{};
  sigset_t before_{};
  int descriptor_ = -1;
};

}  // namespace rattan
