// SPDX-License-Identifier: MIT
#pragma once

// What a checkpoint of the store consists of: the one small file that makes all others count.

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace rattan {

struct StoreRecord {
  /// Checkpoints made in this directory; data files written for it are <stage>.<number>.h5.
  std::uint64_t number = 0;
  /// Versions of chunks given out so far.
  std::uint64_t versions = 0;
  /// The data files that count. Their seals tell one from another, or from an older one, that was
  /// put in its place.
  struct File {
    std::string name;
    std::uint64_t seal = 0;
  };
  std::vector<File> files;
  struct LiveField {
    std::string name;
    std::uint64_t changed = 0;  ///< version of its latest chunk
    /// Into `files`, oldest first: where a chunk is in several, the last has it.
    std::vector<std::uint32_t> files;
  };
  std::vector<LiveField> fields;
  std::map<std::string, std::string> notes;

  static constexpr const char* kFileName = "checkpoint";
};

/// Replaces the record of the directory: after this returns, a power cut leaves the new one. Throws
/// ResourceError, the old one then stands.
void write_record(const std::filesystem::path& directory, const StoreRecord& record);
/// None where there is no file. Throws DamagedFile.
std::optional<StoreRecord> read_record(const std::filesystem::path& directory);

}  // namespace rattan
