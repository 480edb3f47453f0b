// SPDX-License-Identifier: MIT
#pragma once

// One stage's HDF5 file. Layout: for every field a group of its name with `data` (bytes of its
// chunks, in the order in which they came) and `index` (one row per chunk: tile, offset, bytes,
// checksum); the stage's attributes are string attributes of the root group.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

namespace rattan {

struct ChunkRecord {
  std::uint64_t tile = 0;
  std::uint64_t offset = 0;
  std::uint64_t bytes = 0;
  std::uint64_t checksum = 0;
};

/// Not thread safe by itself; the HDF5 library behind it is locked, so several files may be used
/// from several threads. Throws ResourceError (disk full, not writable), InputError (damaged file)
/// or InternalError.
class StageFile {
 public:
  /// A new file at `path` + ".partial", which takes its name when finished. Replaces a leftover.
  static StageFile create(const std::filesystem::path& path);
  /// A finished file, for reading.
  static StageFile open(const std::filesystem::path& path);
  StageFile(StageFile&& other) noexcept;
  StageFile& operator=(StageFile&&) = delete;
  /// Closes. An unfinished file is deleted.
  ~StageFile();

  /// Appends to the field's data; returns the offset.
  std::uint64_t append(const std::string& field, std::span<const std::byte> bytes);
  /// Replaces bytes written before.
  void overwrite(const std::string& field, std::uint64_t offset, std::span<const std::byte> bytes);
  void read(const std::string& field, std::uint64_t offset, std::span<std::byte> bytes);
  void erase_field(const std::string& field);

  using Contents = std::map<std::string, std::vector<ChunkRecord>>;
  using Attributes = std::map<std::string, std::string>;
  /// Of a finished file.
  const Contents& contents() const { return contents_; }
  const Attributes& attributes() const { return attributes_; }

  /// Writes indices and attributes, syncs, renames, and opens for reading again.
  void finish(Contents contents, Attributes attributes);
  /// Makes a finished file unfinished again, for writing.
  void resume();
  bool finished() const { return finished_; }
  /// Where the file is now.
  std::filesystem::path path() const;

  static constexpr const char* kPartialSuffix = ".partial";

 private:
  struct Dataset {
    std::int64_t id = -1;  // hid_t
    std::uint64_t bytes = 0;
  };

  explicit StageFile(std::filesystem::path path) : path_(std::move(path)) {}
  void open_finished();
  void load_contents();
  Dataset& dataset(const std::string& field, bool may_create);
  void close() noexcept;

  std::filesystem::path path_;  ///< the final name
  std::int64_t file_ = -1;      // hid_t
  bool finished_ = false;
  std::unordered_map<std::string, Dataset> datasets_;
  Contents contents_;
  Attributes attributes_;
};

/// Makes a renamed file's name survive a power cut. Throws ResourceError.
void sync_path(const std::filesystem::path& path);

}  // namespace rattan
