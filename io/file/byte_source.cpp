// SPDX-License-Identifier: MIT
#include "io/file/byte_source.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <span>
#include <sys/stat.h>
#include <unistd.h>

#include <oneapi/tbb/task_group.h>

#include "engine/core/errors.h"
#include "engine/core/hand_over.h"
#include "io/file/decompressor.h"
#include "io/file/sha256.h"
#include "io/scan/scan_reader.h"

namespace rattan {
namespace {

constexpr std::size_t kMaxLine = std::size_t{16} << 20;

}  // namespace

// Hashes a copy of each block in a task of its own while the caller parses the block: one copy in
// flight, so memory is bounded and the order is that of the file.
class ByteSource::Hasher {
 public:
  ~Hasher() { wait(); }

  void add(const char* data, std::size_t bytes) {
    wait();
    block_.assign(data, data + bytes);
    begun_.give();
    group_.run([this] {
      begun_.take();
      sha_.update(std::as_bytes(std::span(block_)));
      ended_.give();
    });
  }
  std::string finish() {
    wait();
    return sha_.hex_digest();
  }

 private:
  // Not isolated: with a single thread, it is this one that has to run the task.
  void wait() {
    group_.wait();
    ended_.take();
  }

  Sha256 sha_;
  std::vector<char> block_;
  HandOver begun_;
  HandOver ended_;
  oneapi::tbb::task_group group_;
};

ByteSource::ByteSource(std::string path, std::size_t buffer_bytes, ScanFileInfo& info)
    : path_(std::move(path)), info_(info) {
  const auto reason = [] { return std::string(std::strerror(errno)); };
  descriptor_ = ::open(path_.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0) {
    throw InputError(path_, "", "the file cannot be opened: " + reason(),
                     "Check the path and its permissions");
  }
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) {
    const std::string why = reason();
    ::close(descriptor_);
    throw InputError(path_, "", "the file cannot be examined: " + why, "Check the disk");
  }
  if (S_ISDIR(status.st_mode)) {
    ::close(descriptor_);
    throw InputError(path_, "", "this is a directory, not a scan", "Name the scan file inside it");
  }
  std::uint64_t size = 0;
  if (S_ISREG(status.st_mode)) {
    size = static_cast<std::uint64_t>(status.st_size);
    ::posix_fadvise(descriptor_, 0, 0, POSIX_FADV_SEQUENTIAL);
  }
  buffer_.resize(std::max(buffer_bytes, kCompressionMagicBytes));
  cursor_ = end_ = buffer_.data();
  if (info.want_sha256) {
    hasher_ = std::make_unique<Hasher>();
  }
  info_.bytes = size;
  info_.bytes_read = 0;
  try {
    open_content(size);
  } catch (...) {
    ::close(descriptor_);
    throw;
  }
}

ByteSource::~ByteSource() {
  ::close(descriptor_);
}

void ByteSource::open_content(std::uint64_t file_bytes) {
  std::size_t head = 0;
  while (head < kCompressionMagicBytes) {
    const std::size_t got = read_file(buffer_.data() + head, kCompressionMagicBytes - head);
    if (got == 0) {
      break;
    }
    head += got;
  }
  decompressor_ = Decompressor::recognise(
      {buffer_.data(), head}, path_, [this](char* to, std::size_t n) { return read_file(to, n); });
  if (decompressor_ == nullptr) {
    content_bytes_ = file_bytes;
    end_ += head;
    read_bytes_ = head;
  }
}

std::size_t ByteSource::read_file(char* to, std::size_t n) {
  ssize_t got = 0;
  do {
    got = ::read(descriptor_, to, n);
  } while (got < 0 && errno == EINTR);
  if (got < 0) {
    throw InputError(path_, "byte " + std::to_string(file_read_),
                     std::string("reading failed: ") + std::strerror(errno),
                     "Check the disk and the connection to it");
  }
  if (hasher_ && got > 0) {
    hasher_->add(to, static_cast<std::size_t>(got));
  }
  file_read_ += static_cast<std::uint64_t>(got);
  info_.bytes_read = file_read_;
  return static_cast<std::size_t>(got);
}

bool ByteSource::read_more() {
  if (at_end_) {
    return false;
  }
  const std::size_t kept = available();
  if (kept > 0 && cursor_ != buffer_.data()) {
    std::memmove(buffer_.data(), cursor_, kept);
  }
  cursor_ = buffer_.data();
  end_ = cursor_ + kept;
  char* to = buffer_.data() + kept;
  const std::size_t room = buffer_.size() - kept;
  const std::size_t got =
      decompressor_ != nullptr ? decompressor_->read(to, room) : read_file(to, room);
  if (got == 0) {
    at_end_ = true;
    return false;
  }
  end_ += got;
  read_bytes_ += got;
  return true;
}

bool ByteSource::fill_slow(std::size_t n) {
  if (n > buffer_.size()) {
    const std::size_t kept = available();
    const std::size_t at = static_cast<std::size_t>(cursor_ - buffer_.data());
    buffer_.resize(std::max(n, 2 * buffer_.size()));  // doubling: a long line costs linear time
    cursor_ = buffer_.data() + at;
    end_ = cursor_ + kept;
  }
  while (available() < n) {
    if (!read_more()) {
      return false;
    }
  }
  return true;
}

bool ByteSource::skip(std::uint64_t n) {
  while (n > available()) {
    n -= available();
    cursor_ = end_;
    if (!read_more()) {
      return false;
    }
  }
  consume(static_cast<std::size_t>(n));
  return true;
}

void ByteSource::drain() {
  do {
    cursor_ = end_;
  } while (read_more());
  info_.bytes = file_read_;
  if (hasher_) {
    info_.sha256 = hasher_->finish();
  }
}

bool ByteSource::next_line(std::string_view& line) {
  std::size_t searched = 0;
  const char* newline = nullptr;
  for (;;) {
    newline =
        static_cast<const char*>(std::memchr(cursor_ + searched, '\n', available() - searched));
    if (newline != nullptr) {
      break;
    }
    searched = available();
    if (searched > kMaxLine) {
      ++line_number_;
      fail_at_line("the line is longer than 16 MiB", "Check that this is the format it claims");
    }
    if (!fill(searched + 1) && searched == available()) {
      break;
    }
  }
  if (newline == nullptr && available() == 0) {
    return false;
  }
  const char* stop = newline != nullptr ? newline : end_;
  std::size_t length = static_cast<std::size_t>(stop - cursor_);
  if (length > 0 && cursor_[length - 1] == '\r') {
    --length;
  }
  line = std::string_view(cursor_, length);
  cursor_ = newline != nullptr ? newline + 1 : end_;
  ++line_number_;
  return true;
}

void ByteSource::fail_at_line(const std::string& problem, const std::string& remedy) const {
  throw InputError(path_, "line " + std::to_string(line_number_), problem, remedy);
}

void ByteSource::fail_at_byte(std::uint64_t at, const std::string& problem,
                              const std::string& remedy) const {
  throw InputError(
      path_, "byte " + std::to_string(at) + (is_compressed() ? " of the decompressed content" : ""),
      problem, remedy);
}

}  // namespace rattan
