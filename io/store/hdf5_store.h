// SPDX-License-Identifier: MIT
#pragma once

// The store of one scan's work: a write-back cache of chunks over one HDF5 file per stage. If the
// cache holds everything and nothing is to be kept, the disk is never touched.

#include <cstdint>
#include <filesystem>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "engine/core/memory_budget.h"
#include "engine/core/store.h"
#include "io/store/stage_file.h"

namespace rattan {

struct Hdf5StoreOptions {
  /// Holds <stage>.h5 of every complete stage, and <stage>.h5.partial while a stage is written.
  /// Created when first needed. Stages that are complete there are available from the start.
  std::filesystem::path directory;
  /// Bytes of chunks in memory. Chunks that readers still pin, or that are being written by one of
  /// the threads, come on top.
  std::uint64_t cache_bytes = std::uint64_t{1} << 30;
  /// If there is one, the cache also stays within its share and gives way to reservations. Must
  /// outlive the store.
  MemoryBudget* budget = nullptr;
  /// Complete stages stay on disk when the store is closed; else they never need to get there.
  bool keep = false;
  /// For looking at a directory that another process may own: nothing there is changed.
  bool read_only = false;
};

/// For `rattan info`.
struct StoredField {
  std::string name;  ///< "stage/field"
  std::uint64_t chunks = 0;
  std::uint64_t bytes = 0;
};
struct StoredStage {
  std::string name;
  bool complete = false;
  std::uint64_t file_bytes = 0;  ///< 0 while everything is in memory
  std::map<std::string, std::string> attributes;
  std::vector<StoredField> fields;  ///< by name
};

/// Thread safe. The stage of a field is the part of its name before '/'. Chunks carry checksums,
/// verified when they come back from disk.
/// Throws ResourceError if the disk is full or the directory not usable, InputError if a file of
/// the directory is damaged, InternalError for a chunk that was never written.
class Hdf5Store final : public Store {
 public:
  explicit Hdf5Store(Hdf5StoreOptions options);
  Hdf5Store(const Hdf5Store&) = delete;
  Hdf5Store& operator=(const Hdf5Store&) = delete;
  /// Deletes what is not to be kept, and the directory if that leaves it empty.
  ~Hdf5Store() override;

  /// A complete stage that is written to becomes incomplete.
  void write_chunk(std::string_view field, TileId tile, ChunkBytes bytes) override;
  ChunkBytes read_chunk(std::string_view field, TileId tile) override;
  bool has_chunk(std::string_view field, TileId tile) const override;
  void erase(std::string_view field) override;

  /// Text kept with the stage: options, hashes of inputs. Belongs before complete_stage.
  void set_attribute(std::string_view stage, const std::string& name, std::string value);
  std::optional<std::string> attribute(std::string_view stage, const std::string& name) const;
  /// With `keep`: everything of the stage is on disk, synced, under its final name. Else only notes
  /// it.
  void complete_stage(std::string_view stage);
  bool is_complete(std::string_view stage) const;
  /// Changes Hdf5StoreOptions::keep, for work that is to be kept until it has succeeded.
  void set_keep(bool keep);
  /// Forgets the stage and deletes its file.
  void discard_stage(std::string_view stage);

  /// By name.
  std::vector<StoredStage> list() const;

  /// Traffic with the disk so far.
  std::uint64_t bytes_read() const;
  std::uint64_t bytes_written() const;
  /// Chunk bytes in the cache now.
  std::uint64_t cached_bytes() const;

 private:
  struct Field;
  using LruList = std::list<std::pair<Field*, std::uint32_t>>;  // front: evicted next

  struct Entry {
    ChunkBytes data;  ///< null: only on disk
    std::uint64_t bytes = 0;
    std::uint64_t version = 0;  ///< of the content, unique in the store
    bool on_disk = false;       ///< the content is at `offset`
    std::uint64_t offset = 0;
    std::uint64_t capacity = 0;  ///< bytes of the file at `offset` that belong to this chunk
    std::uint64_t checksum = 0;
    std::uint64_t last_miss = 0;  ///< count of misses when it was last read from disk
    bool in_lru = false;
    LruList::iterator lru;
  };
  struct Stage {
    std::optional<StageFile> file;
    bool complete = false;
    StageFile::Attributes attributes;
  };
  struct Field {
    std::string name;
    std::string short_name;  ///< without the stage
    std::string stage_name;
    Stage* stage = nullptr;
    std::unordered_map<std::uint32_t, Entry> chunks;
  };
  struct Hash {
    using is_transparent = void;
    std::size_t operator()(std::string_view s) const { return std::hash<std::string_view>{}(s); }
  };
  template <class T>
  using Names = std::unordered_map<std::string, T, Hash, std::equal_to<>>;

  Field& field_of(std::string_view name);
  const Entry* find(std::string_view field, TileId tile) const;
  std::filesystem::path path_of(const std::string& stage) const;
  StageFile& writable_file(const std::string& name, Stage& stage);

  // With mutex_ held:
  void drop_data(Entry& entry);
  void touch(Field& field, std::uint32_t tile, Entry& entry, bool last);
  /// Evicts until the cache is within its size; gives up the lock while writing.
  void shrink(std::unique_lock<std::mutex>& lock);
  /// Looks at the budget now and then: often enough that few chunks come between.
  void look_at_budget();

  /// Writes one chunk's current content; io_mutex_ held, mutex_ not.
  void write_out(Field& field, std::uint32_t tile, std::uint64_t version, const ChunkBytes& data,
                 std::uint64_t checksum);

  Hdf5StoreOptions options_;
  bool may_remove_directory_ = false;

  // io_mutex_ guards the files and the fields' existence; it is taken before mutex_.
  mutable std::mutex io_mutex_;
  mutable std::mutex mutex_;
  Names<Stage> stages_;
  Names<Field> fields_;
  LruList lru_;
  std::uint64_t cached_bytes_ = 0;
  std::uint64_t cache_limit_ = 0;
  std::uint32_t looks_ = 0;
  std::uint64_t next_version_ = 1;
  std::uint64_t misses_ = 0;
  std::uint64_t bytes_read_ = 0;
  std::uint64_t bytes_written_ = 0;
};

}  // namespace rattan
