// SPDX-License-Identifier: MIT
#include "io/store/store_record.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <span>
#include <unistd.h>

#include "engine/core/archive.h"
#include "io/file/atomic_file.h"
#include "io/store/checksum.h"
#include "io/store/stage_file.h"

namespace rattan {

namespace fs = std::filesystem;

template <class A>
void members_of(A& a, StoreRecord::File& f) {
  a(f.name);
  a(f.seal);
}

template <class A>
void members_of(A& a, StoreRecord::LiveField& f) {
  a(f.name);
  a(f.changed);
  a(f.files);
}

template <class A>
void members_of(A& a, StoreRecord& r) {
  a(r.number);
  a(r.versions);
  a(r.files);
  a(r.fields);
  a(r.notes);
}

namespace {

constexpr std::string_view kMagic = "rattan checkpoint 1\n";

std::uint64_t sum_of(std::string_view bytes) {
  return checksum(std::as_bytes(std::span(bytes.data(), bytes.size())), bytes.size());
}

[[noreturn]] void fail(const fs::path& path, const char* doing, int error) {
  const std::string text =
      path.string() + ": cannot be " + doing + " (" + std::strerror(error) + ")";
  if (error == ENOSPC || error == EDQUOT || error == EFBIG) {
    throw DiskFull(text);
  }
  throw ResourceError(text + ". Check the directory, or choose another with --work-dir.");
}

}  // namespace

void write_record(const fs::path& directory, const StoreRecord& record) {
  const std::string packed = pack(record);
  std::string bytes(kMagic);
  bytes += pack(sum_of(packed));
  bytes += packed;
  const fs::path path = directory / StoreRecord::kFileName;
  fs::path partial = path;
  partial += StageFile::kPartialSuffix;
  const int fd = ::open(partial.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (fd < 0) {
    fail(partial, "created", errno);
  }
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t put = ::write(fd, bytes.data() + done, bytes.size() - done);
    if (put < 0 && errno == EINTR) {
      continue;
    }
    if (put < 0) {
      const int error = errno;
      ::close(fd);
      ::unlink(partial.c_str());
      fail(partial, "written", error);
    }
    done += static_cast<std::size_t>(put);
  }
  const int synced = ::fsync(fd);
  const int error = errno;
  ::close(fd);
  if (synced != 0) {
    ::unlink(partial.c_str());
    fail(partial, "synced", error);
  }
  if (::rename(partial.c_str(), path.c_str()) != 0) {
    fail(path, "replaced", errno);
  }
  sync_path(directory);
}

std::optional<StoreRecord> read_record(const fs::path& directory) {
  const fs::path path = directory / StoreRecord::kFileName;
  std::error_code error;
  if (!fs::exists(path, error)) {
    return std::nullopt;
  }
  std::string bytes;
  try {
    bytes = read_file(path.string());
  } catch (const InputError&) {
    throw DamagedFile(path, "", "it cannot be read");
  }
  const std::string_view all(bytes);
  constexpr std::size_t kHead = kMagic.size() + sizeof(std::uint64_t);
  if (all.size() < kHead || all.substr(0, kMagic.size()) != kMagic ||
      all.substr(kMagic.size(), sizeof(std::uint64_t)) != pack(sum_of(all.substr(kHead)))) {
    throw DamagedFile(path, "", "it does not match its checksum");
  }
  StoreRecord record;
  unpack(all.substr(kHead), record);
  return record;
}

}  // namespace rattan
