// SPDX-License-Identifier: MIT
#pragma once

// One HDF5 file of the store. Layout: for every field a group of its name with `data` (bytes of its
// chunks, in the order in which they came) and `index` (one row per chunk: tile, offset, bytes,
// checksum).

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "engine/core/errors.h"

namespace rattan {

struct ChunkRecord {
  std::uint64_t tile = 0;
  std::uint64_t offset = 0;
  std::uint64_t bytes = 0;
  std::uint64_t checksum = 0;
};

/// There is no room where the store writes. The store completes the sentence.
class DiskFull : public ResourceError {
 public:
  using ResourceError::ResourceError;
};

/// A file of the store that is not what was written. `path` names it.
class DamagedFile : public InputError {
 public:
  DamagedFile(const std::filesystem::path& path, const std::string& place, const std::string& what);
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// A file is written, then sealed, then committed: once it has its final name it never changes. Not
/// thread safe by itself, but commit may run beside reads; the HDF5 library behind it is locked, so
/// several files may be used from several threads. Throws DiskFull or other ResourceErrors,
/// DamagedFile or InternalError.
class StageFile {
 public:
  /// A new file at `path` + ".partial". Replaces a leftover.
  static std::unique_ptr<StageFile> create(const std::filesystem::path& path);
  /// A committed file, for reading.
  static std::unique_ptr<StageFile> open(const std::filesystem::path& path);
  StageFile(const StageFile&) = delete;
  StageFile& operator=(const StageFile&) = delete;
  /// Closes. A file that was not committed is deleted.
  ~StageFile();

  /// Appends to the field's data; returns the offset.
  std::uint64_t append(const std::string& field, std::span<const std::byte> bytes);
  /// Replaces bytes written before.
  void overwrite(const std::string& field, std::uint64_t offset, std::span<const std::byte> bytes);
  void read(const std::string& field, std::uint64_t offset, std::span<std::byte> bytes);
  void erase_field(const std::string& field);

  using Contents = std::map<std::string, std::vector<ChunkRecord>>;
  /// Of a file that was opened; empties it.
  Contents take_contents() { return std::move(contents_); }

  /// Writes the index; nothing can be written any more.
  void seal(const Contents& contents);
  bool committed() const { return committed_; }
  /// Checksum of all that a sealed file holds, by way of its index.
  std::uint64_t seal_sum() const { return seal_sum_; }
  /// About what it takes on disk.
  std::uint64_t bytes() const { return most_bytes_; }
  std::string name() const { return path_.filename().string(); }
  /// After seal: syncs, and gives the file its name. The directory is for the caller to sync.
  void commit();
  /// Where the file is now.
  std::filesystem::path path() const;
  /// For a file that nobody needs any more: deletes it when it is closed.
  void discard() { discarded_ = true; }

  static constexpr const char* kExtension = ".h5";
  static constexpr const char* kPartialSuffix = ".partial";

 private:
  struct Dataset {
    std::int64_t id = -1;  // hid_t
    std::uint64_t bytes = 0;
  };

  explicit StageFile(std::filesystem::path path) : path_(std::move(path)) {}
  void open_sealed();
  void load_contents();
  Dataset& dataset(const std::string& field, bool may_create);
  void close() noexcept;

  std::filesystem::path path_;  ///< the final name
  std::int64_t file_ = -1;      // hid_t
  bool sealed_ = false;
  bool discarded_ = false;
  std::atomic<bool> committed_ = false;
  std::uint64_t seal_sum_ = 0;
  std::uint64_t live_bytes_ = 0;
  std::uint64_t most_bytes_ = 0;
  std::unordered_map<std::string, Dataset> datasets_;
  Contents contents_;
};

/// Makes the bytes of a file, or the names in a directory, survive a power cut. Throws
/// ResourceError.
void sync_path(const std::filesystem::path& path);

}  // namespace rattan
