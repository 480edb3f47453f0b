// SPDX-License-Identifier: MIT
#include "io/store/work_lock.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <optional>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>
#include <vector>

#include "engine/core/errors.h"

namespace rattan {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

namespace {

constexpr std::string_view kPrefix = "lock.";
constexpr int kTries = 12;

std::string host_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "unknown";
}

std::string boot_id() {
  std::string id;
  std::ifstream("/proc/sys/kernel/random/boot_id") >> id;
  return id.empty() ? "unknown" : id;
}

struct Holder {
  std::string host;
  std::string boot;
  std::string pid;
  bool here() const { return host == host_name() && boot == boot_id(); }
  std::string text() const { return "host=" + host + "\nboot=" + boot + "\npid=" + pid + "\n"; }
};

std::string read_all(int fd) {
  std::array<char, 1024> bytes{};
  const ssize_t got = ::pread(fd, bytes.data(), bytes.size(), 0);
  return {bytes.data(), got > 0 ? static_cast<std::size_t>(got) : 0};
}

Holder parse(const std::string& text) {
  const auto value = [&](const std::string& key) {
    const std::size_t at = text.find(key + "=");
    if (at == std::string::npos) {
      return std::string();
    }
    const std::size_t from = at + key.size() + 1;
    return text.substr(from, text.find('\n', from) - from);
  };
  return {value("host"), value("boot"), value("pid")};
}

/// Locks are kept by the kernel on behalf of the open file, not of the process: threads and forks
/// don't matter.
enum class Grip { kTaken, kRefused, kNoSuchThing };
Grip grip(int fd) {
  struct flock whole {};
  whole.l_type = F_WRLCK;
  whole.l_whence = SEEK_SET;
  if (::fcntl(fd, F_OFD_SETLK, &whole) == 0) {
    return Grip::kTaken;
  }
  return errno == EAGAIN || errno == EACCES ? Grip::kRefused : Grip::kNoSuchThing;
}

std::int64_t nanoseconds(const timespec& t) {
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

/// How long ago the file was touched, by the clock that gives times to files of that directory.
milliseconds age(const fs::path& directory, int fd) {
  struct stat touched {};
  if (::fstat(fd, &touched) != 0) {
    return milliseconds::max();
  }
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  const fs::path probe = directory / (".clock." + host_name() + "." + std::to_string(::getpid()));
  const int probe_fd = ::open(probe.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (probe_fd >= 0) {
    struct stat fresh {};
    if (::futimens(probe_fd, nullptr) == 0 && ::fstat(probe_fd, &fresh) == 0) {
      now = fresh.st_mtim;
    }
    ::unlink(probe.c_str());
    ::close(probe_fd);
  }
  return milliseconds((nanoseconds(now) - nanoseconds(touched.st_mtim)) / 1'000'000);
}

/// Numbers of the lock files there are, ascending.
std::vector<std::uint64_t> lock_numbers(const fs::path& directory) {
  std::vector<std::uint64_t> numbers;
  std::error_code error;
  for (fs::directory_iterator at(directory, error), end; !error && at != end; at.increment(error)) {
    const std::string name = at->path().filename().string();
    std::uint64_t n = 0;
    if (name.starts_with(kPrefix) &&
        std::from_chars(name.data() + kPrefix.size(), name.data() + name.size(), n).ptr ==
            name.data() + name.size()) {
      numbers.push_back(n);
    }
  }
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

fs::path lock_path(const fs::path& directory, std::uint64_t number) {
  return directory / (std::string(kPrefix) + std::to_string(number));
}

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) {
      ::close(fd_);
    }
  }
  int get() const { return fd_; }
  int release() { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

[[noreturn]] void unusable(const fs::path& directory, const char* doing, int error) {
  throw ResourceError(directory.string() + ": cannot be " + doing + " (" + std::strerror(error) +
                      "). Make room there or choose another directory with --work-dir.");
}

}  // namespace

WorkLock::WorkLock(const fs::path& directory, Timing timing)
    : directory_(directory), timing_(timing) {
  std::string holder;
  bool taken = false;
  try {
    taken = take(holder);
  } catch (...) {
    remove_directory();
    throw;
  }
  if (!taken) {
    throw DirectoryInUse(directory_.string() + ": the work directory is in use by " +
                         (holder.empty() ? "other processes" : holder) +
                         ". Wait for it to end, or choose another directory with --work-dir.");
  }
  toucher_ = std::thread([this] { keep_touching(); });
}

void WorkLock::remove_directory() const {
  ::rmdir(directory_.c_str());  // only if empty
}

bool WorkLock::take(std::string& holder) {
  std::uint32_t noise = static_cast<std::uint32_t>(::getpid()) * 2654435761U;
  for (int tries = 0; tries < kTries; ++tries) {
    if (try_take(holder)) {
      return true;
    }
    if (!holder.empty()) {
      return false;
    }
    noise = noise * 1664525U + 1013904223U;
    std::this_thread::sleep_for(milliseconds(20 + (noise >> 16) % 180));
  }
  return false;
}

// False with a name: the directory is in use. False without: others are at it too, try again.
bool WorkLock::try_take(std::string& holder) {
  std::error_code error;
  fs::create_directories(directory_, error);
  if (error) {
    unusable(directory_, "created", error.value());
  }
  const std::vector<std::uint64_t> found = lock_numbers(directory_);
  std::vector<Descriptor> dead;
  for (const std::uint64_t n : found) {
    Descriptor file(::open(lock_path(directory_, n).c_str(), O_RDWR | O_CLOEXEC));
    if (file.get() < 0) {
      if (errno == ENOENT) {
        return false;
      }
      unusable(directory_, "locked", errno);
    }
    const Grip got = grip(file.get());
    Holder other = parse(read_all(file.get()));
    for (int wait = 0; other.pid.empty() && wait < 10; ++wait) {  // it was created just now
      std::this_thread::sleep_for(milliseconds(50));
      other = parse(read_all(file.get()));
    }
    const bool known_dead = got == Grip::kTaken && (other.here() || other.pid.empty());
    const bool known_alive = got == Grip::kRefused && other.here();
    if (known_alive || (!known_dead && age(directory_, file.get()) < timing_.dead_after)) {
      holder = "process " + other.pid + " on " + other.host;
      return false;
    }
    dead.push_back(std::move(file));
  }

  const std::uint64_t number = found.empty() ? 1 : found.back() + 1;
  const fs::path path = lock_path(directory_, number);
  Descriptor file(::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (file.get() < 0) {
    if (errno == EEXIST || errno == ENOENT) {
      return false;
    }
    unusable(directory_, "locked", errno);
  }
  const auto give_back = [&] {
    ::unlink(path.c_str());
    return false;
  };
  if (grip(file.get()) == Grip::kRefused) {
    return give_back();
  }
  const std::string text = Holder{host_name(), boot_id(), std::to_string(::getpid())}.text();
  if (::write(file.get(), text.data(), text.size()) != static_cast<ssize_t>(text.size())) {
    const int why = errno == 0 ? ENOSPC : errno;
    ::unlink(path.c_str());
    unusable(directory_, "locked", why);
  }
  std::vector<std::uint64_t> expected = found;
  expected.push_back(number);
  if (lock_numbers(directory_) != expected) {
    return give_back();
  }
  for (const std::uint64_t n : found) {
    ::unlink(lock_path(directory_, n).c_str());
  }
  path_ = path;
  number_ = number;
  fd_ = file.release();
  return true;
}

WorkLock::~WorkLock() {
  {
    const std::scoped_lock lock(mutex_);
    ending_ = true;
  }
  wake_.notify_all();
  toucher_.join();
  if (held()) {
    ::unlink(path_.c_str());
    remove_directory();
  }
  ::close(fd_);
}

bool WorkLock::held() const {
  struct stat mine {};
  struct stat there {};
  const std::vector<std::uint64_t> numbers = lock_numbers(directory_);
  return !numbers.empty() && numbers.back() == number_ && ::fstat(fd_, &mine) == 0 &&
         ::stat(path_.c_str(), &there) == 0 && mine.st_ino == there.st_ino &&
         mine.st_dev == there.st_dev;
}

std::optional<std::string> WorkLock::holder(const fs::path& directory) {
  const std::vector<std::uint64_t> found = lock_numbers(directory);
  for (auto n = found.rbegin(); n != found.rend(); ++n) {
    const Descriptor file(::open(lock_path(directory, *n).c_str(), O_RDONLY | O_CLOEXEC));
    if (file.get() < 0) {
      continue;
    }
    const Holder other = parse(read_all(file.get()));
    struct flock whole {};
    whole.l_type = F_WRLCK;
    whole.l_whence = SEEK_SET;
    const bool asked = ::fcntl(file.get(), F_OFD_GETLK, &whole) == 0;
    const bool locked = asked && whole.l_type != F_UNLCK;
    struct stat touched {};
    timespec now{};
    ::clock_gettime(CLOCK_REALTIME, &now);
    const bool fresh = ::fstat(file.get(), &touched) == 0 &&
                       nanoseconds(now) - nanoseconds(touched.st_mtim) <
                           std::chrono::nanoseconds(Timing().dead_after).count();
    if (asked && other.here() ? locked : fresh) {
      return "process " + other.pid + " on " + other.host;
    }
  }
  return std::nullopt;
}

void WorkLock::keep_touching() {
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, timing_.touch, [this] { return ending_; })) {
    ::futimens(fd_, nullptr);
  }
}

}  // namespace rattan
