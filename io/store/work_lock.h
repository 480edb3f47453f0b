// SPDX-License-Identifier: MIT
#pragma once

// One process at a time in a work directory, also where several machines share it.

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "engine/core/errors.h"

namespace rattan {

/// Another process is at work there.
class DirectoryInUse : public ResourceError {
 public:
  using ResourceError::ResourceError;
};

/// Holds the directory's lock: a file `lock.<n>` that names host, boot and process, is locked in
/// the kernel (an open file description lock, which the kernel drops when the process dies), and is
/// touched every few seconds.
///
/// On one machine the kernel's lock decides. Some shared file systems don't pass locks from machine
/// to machine, or keep those of a machine that died; there the time of the last touch decides, as
/// the file system's own clock has it. A dead holder's lock.<n> is replaced by lock.<n+1>, which
/// only one process can create; whoever finds a lock that it can't account for gives its own back
/// and tries again.
class WorkLock {
 public:
  struct Timing {
    std::chrono::milliseconds touch{5000};
    std::chrono::milliseconds dead_after{30000};
  };
  /// Creates the directory if need be. Throws DirectoryInUse that names the holder, or
  /// ResourceError that says why the directory cannot be used; nothing there is changed then.
  explicit WorkLock(const std::filesystem::path& directory) : WorkLock(directory, Timing()) {}
  WorkLock(const std::filesystem::path& directory, Timing timing);
  /// Gives the lock back; removes the directory if that leaves it empty.
  ~WorkLock();
  WorkLock(const WorkLock&) = delete;
  WorkLock& operator=(const WorkLock&) = delete;

  /// False once somebody else has taken the lock over, as happens to a process that was asleep for
  /// long.
  bool held() const;

  /// "process 12 on host" for a holder that is alive, as far as can be told without touching
  /// anything.
  static std::optional<std::string> holder(const std::filesystem::path& directory);

 private:
  bool take(std::string& holder);
  bool try_take(std::string& holder);
  void remove_directory() const;
  void keep_touching();

  std::filesystem::path directory_;
  Timing timing_;
  std::filesystem::path path_;
  std::uint64_t number_ = 0;
  int fd_ = -1;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool ending_ = false;
  std::thread toucher_;
};

}  // namespace rattan
