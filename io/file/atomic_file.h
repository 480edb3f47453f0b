// SPDX-License-Identifier: MIT
#pragma once

// A file that is either absent (or still its old self) or complete: written under a temporary name
// in the same directory, synced, then renamed.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace rattan {

/// Writes `.<name>.partial` beside `path`; commit() gives it its name. Destroyed without commit,
/// the temporary is removed and whatever stood at `path` is untouched. The temporary's name is
/// fixed, so a run that was killed leaves at most one, which the next run takes over; a second
/// writer of the same path at the same time is refused (advisory lock).
class AtomicFile {
 public:
  /// Throws InputError where the directory is missing or not writable, ResourceError where the
  /// system has no room.
  explicit AtomicFile(std::string path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Buffered. Throws ResourceError when the disk is full.
  void write(std::string_view bytes);
  void write(const void* bytes, std::size_t size) {
    write(std::string_view(static_cast<const char*>(bytes), size));
  }
  /// Everything written so far is on the disk and can be read at temporary_path().
  void sync();
  /// sync(), rename, sync the directory. Call once, last.
  void commit();

  const std::string& path() const { return path_; }
  const std::string& temporary_path() const { return temporary_; }
  std::uint64_t size() const { return size_; }

 private:
  void flush();
  [[noreturn]] void fail(const char* doing, int error) const;

  std::string path_;
  std::string directory_;
  std::string temporary_;
  std::string buffer_;
  std::uint64_t size_ = 0;
  int fd_ = -1;
};

/// The whole file. Throws InputError when it cannot be opened or read.
std::string read_file(const std::string& path);

}  // namespace rattan
