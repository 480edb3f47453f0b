// SPDX-License-Identifier: MIT
#pragma once

// The store of one scan's work: a write-back cache of chunks over HDF5 files. If the cache holds
// everything and nothing is to be kept, the disk is never touched.

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <future>
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
#include "io/store/store_record.h"

namespace rattan {

struct Hdf5StoreOptions {
  /// Created when first needed. What its last checkpoint holds is available from the start.
  std::filesystem::path directory;
  /// Bytes of chunks in memory. Chunks that readers still pin, or that are being written by one of
  /// the threads, come on top.
  std::uint64_t cache_bytes = std::uint64_t{1} << 30;
  /// If there is one, the cache also stays within its share and gives way to reservations. Must
  /// outlive the store.
  MemoryBudget* budget = nullptr;
  /// The last checkpoint stays when the store is closed; else nothing does.
  bool keep = false;
  /// For looking at a directory that another process may own: nothing there is changed, and damage
  /// is thrown.
  bool read_only = false;
  /// Deletes what an earlier run left instead of taking it up.
  bool fresh = false;
};

/// For `rattan info`.
struct StoredField {
  std::string name;  ///< "stage/field"
  std::uint64_t chunks = 0;
  std::uint64_t bytes = 0;
};
struct StoredStage {
  std::string name;
  std::uint64_t file_bytes = 0;     ///< 0 while everything is in memory
  std::vector<StoredField> fields;  ///< by name
};

/// Thread safe. The stage of a field is the part of its name before '/'. Chunks carry checksums,
/// verified when they come back from disk.
///
/// A checkpoint makes what the store holds outlive the process, a power cut included. Its files
/// never change: later chunks go to later files, and what a checkpoint no longer needs is deleted
/// once it stands. So at any instant the directory holds one whole checkpoint, or none.
///
/// Throws ResourceError if the disk is full or the directory not usable, DamagedFile, InternalError
/// for a chunk that was never written.
class Hdf5Store final : public Store {
 public:
  explicit Hdf5Store(Hdf5StoreOptions options);
  Hdf5Store(const Hdf5Store&) = delete;
  Hdf5Store& operator=(const Hdf5Store&) = delete;
  /// Deletes what is not to be kept, and the directory if that leaves it empty.
  ~Hdf5Store() override;

  void write_chunk(std::string_view field, TileId tile, ChunkBytes bytes) override;
  ChunkBytes read_chunk(std::string_view field, TileId tile) override;
  bool has_chunk(std::string_view field, TileId tile) const override;
  void erase(std::string_view field) override;

  /// All that was written and not erased; `changed` grows whenever a chunk is written.
  struct FieldState {
    std::string name;
    std::uint64_t changed = 0;
    bool operator==(const FieldState&) const = default;
    auto operator<=>(const FieldState&) const = default;
  };
  /// By name.
  std::vector<FieldState> fields() const;

  /// Text kept with the next checkpoint.
  void set_note(const std::string& name, std::string value);
  std::optional<std::string> note(const std::string& name) const;
  /// Nothing else may use the store meanwhile. Returns when all is written; syncing goes on beside
  /// what comes next, and its failure is thrown by the next call or by settle. Does nothing if
  /// nothing is kept.
  void checkpoint();
  /// Waits until the last checkpoint stands.
  void settle();
  bool has_checkpoint() const { return has_checkpoint_; }
  /// Bytes that a checkpoint would have to write.
  std::uint64_t unsaved_bytes() const;
  /// Changes Hdf5StoreOptions::keep, for work that is to be kept until it has succeeded.
  void set_keep(bool keep);
  /// Sentences about files that were found damaged on opening; what they held is gone.
  const std::vector<std::string>& damage() const { return damage_; }

  /// By name.
  std::vector<StoredStage> list() const;

  /// Traffic with the disk so far.
  std::uint64_t bytes_read() const;
  std::uint64_t bytes_written() const;
  /// Bytes of chunks read and written so far, those that the cache served included.
  std::uint64_t bytes_moved() const;
  /// About what the files of the store take on disk, now and at most so far.
  std::uint64_t disk_bytes() const;
  std::uint64_t peak_disk_bytes() const;
  /// Chunk bytes in the cache now.
  std::uint64_t cached_bytes() const;

 private:
  struct Field;
  using LruList = std::list<std::pair<Field*, std::uint32_t>>;  // front: evicted next

  struct Entry {
    ChunkBytes data;  ///< null: only on disk
    std::uint64_t bytes = 0;
    std::uint64_t version = 0;  ///< of the content, unique in the store
    bool on_disk = false;       ///< the content is at `offset` of `file`
    StageFile* file = nullptr;
    std::uint64_t offset = 0;
    std::uint64_t capacity = 0;  ///< bytes of the file at `offset` that belong to this chunk
    std::uint64_t checksum = 0;
    std::uint64_t last_miss = 0;  ///< count of misses when it was last read from disk
    bool in_lru = false;
    LruList::iterator lru;
  };
  struct Stage {
    std::unique_ptr<StageFile> open;  ///< since the last checkpoint
    std::vector<std::shared_ptr<StageFile>> sealed;
  };
  struct Field {
    std::string name;
    std::string short_name;  ///< without the stage
    std::string stage_name;
    Stage* stage = nullptr;
    std::uint64_t changed = 0;
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
  StageFile& writable_file(const std::string& name, Stage& stage);
  void take_up();
  void open_checkpoint(const StoreRecord& record);
  void delete_leftovers(const StoreRecord& record);
  void delete_everything();
  std::vector<Field*> fields_of(const Stage& stage);
  void write_unsaved(Stage& stage);
  void seal(Stage& stage);
  [[noreturn]] void refuse(const DiskFull& full) const;
  std::uint64_t bytes_on_disk() const;

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
  std::vector<std::string> damage_;
  std::uint64_t number_ = 0;  ///< of the last checkpoint begun
  std::atomic<bool> has_checkpoint_ = false;
  std::future<void> committing_;
  std::atomic<std::uint64_t> dying_bytes_ = 0;  ///< of files to be deleted once a checkpoint stands
  std::uint64_t peak_disk_bytes_ = 0;
  std::map<std::string, std::string> notes_;

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
  std::uint64_t bytes_moved_ = 0;
};

}  // namespace rattan
