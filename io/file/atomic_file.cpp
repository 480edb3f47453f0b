// SPDX-License-Identifier: MIT
#include "io/file/atomic_file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

#include "engine/core/errors.h"

namespace rattan {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 20;

bool out_of_room(int error) {
  return error == ENOSPC || error == EDQUOT || error == EFBIG || error == ENOMEM ||
         error == EMFILE || error == ENFILE || error == EIO;
}

}  // namespace

AtomicFile::AtomicFile(std::string path) : path_(std::move(path)) {
  const std::filesystem::path full(path_);
  directory_ = full.has_parent_path() ? full.parent_path().string() : std::string(".");
  if (full.filename().empty() || std::filesystem::is_directory(full)) {
    throw InputError(path_, "", "the output is a directory", "Give a file name");
  }
  std::string name(1, '.');
  name.append(full.filename().string()).append(".partial");
  temporary_ = (std::filesystem::path(directory_) / name).string();
  fd_ = ::open(temporary_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
  if (fd_ < 0) {
    fail("cannot be created", errno);
  }
  if (::flock(fd_, LOCK_EX | LOCK_NB) != 0) {
    ::close(fd_);
    fd_ = -1;
    throw ResourceError(path_ + ": another process is writing this file. Wait for it to end.");
  }
  if (::ftruncate(fd_, 0) != 0) {
    const int error = errno;
    ::unlink(temporary_.c_str());
    ::close(fd_);
    fd_ = -1;
    fail("cannot be emptied", error);
  }
  buffer_.reserve(kBufferBytes);
}

AtomicFile::~AtomicFile() {
  if (fd_ >= 0) {
    ::unlink(temporary_.c_str());
    ::close(fd_);
  }
}

void AtomicFile::fail(const char* doing, int error) const {
  const std::string problem = std::string("the file ") + doing + " (" + std::strerror(error) + ")";
  if (out_of_room(error)) {
    throw ResourceError(path_ + ": " + problem + " after " + std::to_string(size_) +
                        " bytes. Make room on the disk or write elsewhere.");
  }
  throw InputError(path_, "", problem, "Give a directory that exists and can be written to");
}

void AtomicFile::write(std::string_view bytes) {
  if (buffer_.size() + bytes.size() > kBufferBytes) {
    flush();
  }
  buffer_.append(bytes);
  size_ += bytes.size();
}

void AtomicFile::flush() {
  const char* from = buffer_.data();
  std::size_t left = buffer_.size();
  while (left > 0) {
    const ssize_t done = ::write(fd_, from, left);
    if (done < 0) {
      if (errno == EINTR) {
        continue;
      }
      fail("cannot be written", errno);
    }
    from += done;
    left -= static_cast<std::size_t>(done);
  }
  buffer_.clear();
}

void AtomicFile::sync() {
  flush();
  if (::fsync(fd_) != 0) {
    fail("cannot be synced", errno);
  }
}

void AtomicFile::commit() {
  sync();
  if (::rename(temporary_.c_str(), path_.c_str()) != 0) {
    fail("cannot take its name", errno);
  }
  ::close(fd_);
  fd_ = -1;
  const int directory = ::open(directory_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (directory >= 0) {
    // Some network file systems cannot sync a directory; the rename is done all the same.
    ::fsync(directory);
    ::close(directory);
  }
}

std::string read_file(const std::string& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) {
    throw InputError(path, "", std::string("cannot be opened (") + std::strerror(errno) + ")",
                     "Check the path and its permissions");
  }
  std::string bytes;
  struct stat info {};
  if (::fstat(fd, &info) == 0 && S_ISREG(info.st_mode)) {
    bytes.reserve(static_cast<std::size_t>(info.st_size) + 1);
  }
  std::size_t used = 0;
  for (;;) {
    bytes.resize(std::max(used + 65536, bytes.capacity()));
    const ssize_t got = ::read(fd, bytes.data() + used, bytes.size() - used);
    if (got < 0 && errno == EINTR) {
      continue;
    }
    if (got < 0) {
      const int error = errno;
      ::close(fd);
      throw InputError(path, "byte " + std::to_string(used),
                       std::string("cannot be read (") + std::strerror(error) + ")",
                       "Check that it is a file on a healthy disk");
    }
    if (got == 0) {
      break;
    }
    used += static_cast<std::size_t>(got);
  }
  ::close(fd);
  bytes.resize(used);
  return bytes;
}

}  // namespace rattan
