// SPDX-License-Identifier: MIT
#include "io/store/hdf5_store.h"

#include <algorithm>
#include <span>
#include <utility>

#include "engine/core/errors.h"
#include "engine/core/memory_budget.h"
#include "io/store/checksum.h"

namespace rattan {

namespace fs = std::filesystem;

namespace {

/// One in so many chunks read from disk enters the cache as recently used.
constexpr std::uint64_t kAdmitEvery = 32;
/// The budget is looked at when so many chunks have come.
constexpr std::uint32_t kLookEvery = 8;
/// A chunk read again within so many misses is in demand.
constexpr std::uint64_t kAtOnce = 64;

std::string_view stage_part(std::string_view field) {
  const std::size_t slash = field.find('/');
  ensure(slash != std::string_view::npos && slash > 0, "a field's name is \"stage/field\"");
  return field.substr(0, slash);
}

}  // namespace

Hdf5Store::Hdf5Store(Hdf5StoreOptions options)
    : options_(std::move(options)), cache_limit_(options_.cache_bytes) {
  if (options_.fresh) {
    delete_everything();
  } else {
    take_up();
  }
  if (options_.budget != nullptr) {
    options_.budget->set_cache([this] {
      std::unique_lock lock(mutex_);
      looks_ = 0;
      look_at_budget();
      shrink(lock);
    });
  }
}

Hdf5Store::~Hdf5Store() {
  if (options_.budget != nullptr) {
    options_.budget->set_cache({});
  }
  try {
    settle();
  } catch (...) {  // the checkpoint before stands
  }
  if (options_.read_only) {
    return;
  }
  const bool keep = options_.keep && has_checkpoint_;
  if (!keep && has_checkpoint_) {
    std::error_code ignored;
    fs::remove(options_.directory / StoreRecord::kFileName, ignored);
    may_remove_directory_ = true;
  }
  for (auto& [name, stage] : stages_) {
    stage.open.reset();
    for (const auto& file : stage.sealed) {
      if (!keep) {
        file->discard();
      }
    }
    stage.sealed.clear();
  }
  if (!keep && may_remove_directory_) {
    std::error_code ignored;
    fs::remove(options_.directory, ignored);  // only if empty
  }
}

Hdf5Store::Field& Hdf5Store::field_of(std::string_view name) {
  const auto known = fields_.find(name);
  if (known != fields_.end()) {
    return known->second;
  }
  const std::string_view stage = stage_part(name);
  Field& field = fields_[std::string(name)];
  field.name = name;
  field.stage_name = stage;
  field.short_name = name.substr(stage.size() + 1);
  field.stage = &stages_[std::string(stage)];
  return field;
}

const Hdf5Store::Entry* Hdf5Store::find(std::string_view field, TileId tile) const {
  const auto f = fields_.find(field);
  if (f == fields_.end()) {
    return nullptr;
  }
  const auto e = f->second.chunks.find(tile.value);
  return e == f->second.chunks.end() ? nullptr : &e->second;
}

void Hdf5Store::drop_data(Entry& entry) {
  if (entry.in_lru) {
    lru_.erase(entry.lru);
    entry.in_lru = false;
  }
  if (entry.data) {
    cached_bytes_ -= entry.bytes;
    entry.data.reset();
  }
}

void Hdf5Store::touch(Field& field, std::uint32_t tile, Entry& entry, bool last) {
  if (entry.in_lru) {
    lru_.splice(last ? lru_.end() : lru_.begin(), lru_, entry.lru);
  } else {
    entry.lru = lru_.emplace(last ? lru_.end() : lru_.begin(), &field, tile);
    entry.in_lru = true;
  }
}

void Hdf5Store::write_chunk(std::string_view field, TileId tile, ChunkBytes bytes) {
  ensure(!options_.read_only, "a store opened for reading is not written");
  ensure(bytes != nullptr, "a chunk has bytes");
  std::unique_lock lock(mutex_);
  Field& f = field_of(field);
  Entry& e = f.chunks[tile.value];
  drop_data(e);
  e.bytes = bytes->size();
  e.data = std::move(bytes);
  e.version = next_version_++;
  f.changed = e.version;
  e.on_disk = false;
  cached_bytes_ += e.bytes;
  bytes_moved_ += e.bytes;
  touch(f, tile.value, e, true);
  look_at_budget();
  shrink(lock);
}

ChunkBytes Hdf5Store::read_chunk(std::string_view field, TileId tile) {
  std::unique_lock lock(mutex_);
  while (true) {
    Entry* e = const_cast<Entry*>(find(field, tile));
    if (e == nullptr) {
      throw InternalError("chunk " + std::to_string(tile.value) + " of " + std::string(field) +
                          " is read before it was written");
    }
    Field& f = fields_.find(field)->second;
    if (e->data) {
      if (e->in_lru) {
        touch(f, tile.value, *e, true);
      }
      bytes_moved_ += e->bytes;
      return e->data;
    }
    const std::uint64_t version = e->version;
    lock.unlock();
    auto bytes = std::make_shared<std::vector<std::byte>>();
    std::uint64_t expected = 0;
    fs::path path;
    {
      const std::scoped_lock io(io_mutex_);
      std::uint64_t offset = 0;
      lock.lock();
      e = const_cast<Entry*>(find(field, tile));
      if (e == nullptr || e->version != version || !e->on_disk) {
        continue;  // somebody replaced it meanwhile
      }
      offset = e->offset;
      expected = e->checksum;
      const std::uint64_t size = e->bytes;
      StageFile& file = *e->file;
      lock.unlock();
      bytes->resize(size);
      path = file.path();
      file.read(f.short_name, offset, *bytes);
    }
    if (chunk_checksum(field, tile.value, *bytes) != expected) {
      throw DamagedFile(path, "chunk " + std::to_string(tile.value) + " of " + std::string(field),
                        "the data do not match their checksum");
    }
    lock.lock();
    bytes_read_ += bytes->size();
    bytes_moved_ += bytes->size();
    e = const_cast<Entry*>(find(field, tile));
    if (e != nullptr && e->version == version && !e->data) {
      e->data = bytes;
      cached_bytes_ += e->bytes;
      // Passes go over the tiles again and again. If each chunk read displaced the oldest, a cache
      // a little too small would never hit; so with the cache full most chunks read are the next to
      // go, except those that are read again at once.
      ++misses_;
      const bool again = e->last_miss != 0 && misses_ - e->last_miss <= kAtOnce;
      e->last_miss = misses_;
      look_at_budget();
      const bool full = cached_bytes_ > cache_limit_;
      touch(f, tile.value, *e, !full || again || misses_ % kAdmitEvery == 0);
      shrink(lock);
    }
    return bytes;
  }
}

bool Hdf5Store::has_chunk(std::string_view field, TileId tile) const {
  const std::scoped_lock lock(mutex_);
  return find(field, tile) != nullptr;
}

void Hdf5Store::erase(std::string_view field) {
  const std::scoped_lock io(io_mutex_);
  const std::scoped_lock lock(mutex_);
  const auto f = fields_.find(field);
  if (f == fields_.end()) {
    return;
  }
  for (auto& [tile, entry] : f->second.chunks) {
    drop_data(entry);
  }
  Stage& stage = *f->second.stage;
  if (stage.open) {
    stage.open->erase_field(f->second.short_name);
  }
  fields_.erase(f);
  if (stage.open && std::none_of(fields_.begin(), fields_.end(),
                                 [&](const auto& other) { return other.second.stage == &stage; })) {
    stage.open.reset();  // gives its space back
  }
}

void Hdf5Store::look_at_budget() {
  if (options_.budget != nullptr && looks_++ % kLookEvery == 0) {
    cache_limit_ = std::min(options_.cache_bytes, options_.budget->cache_share(cached_bytes_));
  }
}

void Hdf5Store::shrink(std::unique_lock<std::mutex>& lock) {
  while (cached_bytes_ > cache_limit_ && !lru_.empty()) {
    const auto [field, tile] = lru_.front();
    Entry& e = field->chunks.find(tile)->second;
    if (e.on_disk) {
      drop_data(e);
      continue;
    }
    // Others still find the data while they are being written, but don't evict them too.
    lru_.pop_front();
    e.in_lru = false;
    const ChunkBytes data = e.data;
    const std::uint64_t version = e.version;
    const std::string name = field->name;
    lock.unlock();
    const std::uint64_t sum = chunk_checksum(name, tile, *data);
    try {
      const std::scoped_lock io(io_mutex_);
      lock.lock();
      const Entry* now = find(name, TileId(tile));
      if (now == nullptr || now->version != version) {
        continue;  // erased or replaced: nothing to write
      }
      Field& f = fields_.find(name)->second;
      lock.unlock();
      write_out(f, tile, version, data, sum);
    } catch (...) {
      if (!lock.owns_lock()) {
        lock.lock();
      }
      throw;
    }
    lock.lock();
    Entry* now = const_cast<Entry*>(find(name, TileId(tile)));
    if (now != nullptr && now->version == version) {
      drop_data(*now);
    }
  }
}

StageFile& Hdf5Store::writable_file(const std::string& name, Stage& stage) {
  if (!stage.open) {
    std::error_code error;
    if (fs::create_directories(options_.directory, error)) {
      may_remove_directory_ = true;
    }
    if (error) {
      throw ResourceError(options_.directory.string() + ": cannot be created (" + error.message() +
                          "). Choose another directory with --work-dir.");
    }
    stage.open = StageFile::create(
        options_.directory / (name + "." + std::to_string(number_ + 1) + StageFile::kExtension));
  }
  return *stage.open;
}

void Hdf5Store::refuse(const DiskFull& full) const {
  const std::uint64_t unsaved = unsaved_bytes();
  std::error_code error;
  const fs::space_info space = fs::space(options_.directory, error);
  std::string text = full.what();
  text += ". About " + format_bytes(unsaved) + " more are needed there now";
  if (!error) {
    text += " and " + format_bytes(space.available) + " are free";
  }
  throw ResourceError(text + ". Make room, or choose another place with --work-dir.");
}

void Hdf5Store::write_out(Field& field, std::uint32_t tile, std::uint64_t version,
                          const ChunkBytes& data, std::uint64_t sum) {
  std::uint64_t offset = 0;
  std::uint64_t capacity = 0;
  const StageFile* at = nullptr;
  {
    const std::scoped_lock lock(mutex_);
    const Entry& e = field.chunks.find(tile)->second;
    offset = e.offset;
    capacity = e.capacity;
    at = e.file;
  }
  StageFile* file = nullptr;
  try {
    file = &writable_file(field.stage_name, *field.stage);
    if (at == file && data->size() <= capacity) {
      file->overwrite(field.short_name, offset, *data);
    } else {
      offset = file->append(field.short_name, *data);
      capacity = data->size();
    }
  } catch (const DiskFull& full) {
    refuse(full);
  }
  const std::uint64_t on_disk = bytes_on_disk();
  const std::scoped_lock lock(mutex_);
  bytes_written_ += data->size();
  peak_disk_bytes_ = std::max(peak_disk_bytes_, on_disk);
  Entry& e = field.chunks.find(tile)->second;
  e.file = file;
  e.offset = offset;
  e.capacity = capacity;
  if (e.version == version) {
    e.on_disk = true;
    e.checksum = sum;
  }
}

std::uint64_t Hdf5Store::bytes_on_disk() const {
  std::uint64_t bytes = 0;
  for (const auto& [name, stage] : stages_) {
    bytes += stage.open ? stage.open->bytes() : 0;
    for (const auto& file : stage.sealed) {
      bytes += file->bytes();
    }
  }
  return bytes + dying_bytes_;
}

std::uint64_t Hdf5Store::disk_bytes() const {
  const std::scoped_lock io(io_mutex_);
  return bytes_on_disk();
}

std::uint64_t Hdf5Store::peak_disk_bytes() const {
  const std::scoped_lock lock(mutex_);
  return peak_disk_bytes_;
}

std::vector<Hdf5Store::FieldState> Hdf5Store::fields() const {
  const std::scoped_lock lock(mutex_);
  std::vector<FieldState> all;
  all.reserve(fields_.size());
  for (const auto& [name, field] : fields_) {
    all.push_back({name, field.changed});
  }
  std::sort(all.begin(), all.end());
  return all;
}

std::uint64_t Hdf5Store::unsaved_bytes() const {
  const std::scoped_lock lock(mutex_);
  std::uint64_t bytes = 0;
  for (const auto& [name, field] : fields_) {
    for (const auto& [tile, e] : field.chunks) {
      bytes += e.on_disk ? 0 : e.bytes;
    }
  }
  return bytes;
}

void Hdf5Store::set_note(const std::string& name, std::string value) {
  const std::scoped_lock lock(mutex_);
  notes_[name] = std::move(value);
}

std::optional<std::string> Hdf5Store::note(const std::string& name) const {
  const std::scoped_lock lock(mutex_);
  const auto n = notes_.find(name);
  return n == notes_.end() ? std::nullopt : std::optional(n->second);
}

void Hdf5Store::set_keep(bool keep) {
  const std::scoped_lock io(io_mutex_);
  const std::scoped_lock lock(mutex_);
  options_.keep = keep;
}

std::vector<StoredStage> Hdf5Store::list() const {
  const std::scoped_lock io(io_mutex_);
  const std::scoped_lock lock(mutex_);
  std::map<std::string, StoredStage> stages;
  for (const auto& [name, stage] : stages_) {
    StoredStage& s = stages[name];
    s.name = name;
    const auto add = [&](const StageFile& file) {
      std::error_code error;
      const std::uintmax_t size = fs::file_size(file.path(), error);
      s.file_bytes += error ? 0 : size;
    };
    for (const auto& file : stage.sealed) {
      add(*file);
    }
    if (stage.open) {
      add(*stage.open);
    }
  }
  for (const auto& [name, field] : fields_) {
    StoredField f{name, field.chunks.size(), 0};
    for (const auto& [tile, e] : field.chunks) {
      f.bytes += e.bytes;
    }
    stages[field.stage_name].fields.push_back(f);
  }
  std::vector<StoredStage> result;
  for (auto& [name, stage] : stages) {
    std::sort(stage.fields.begin(), stage.fields.end(),
              [](const StoredField& a, const StoredField& b) { return a.name < b.name; });
    result.push_back(std::move(stage));
  }
  return result;
}

std::uint64_t Hdf5Store::bytes_read() const {
  const std::scoped_lock lock(mutex_);
  return bytes_read_;
}

std::uint64_t Hdf5Store::bytes_written() const {
  const std::scoped_lock lock(mutex_);
  return bytes_written_;
}

std::uint64_t Hdf5Store::bytes_moved() const {
  const std::scoped_lock lock(mutex_);
  return bytes_moved_;
}

std::uint64_t Hdf5Store::cached_bytes() const {
  const std::scoped_lock lock(mutex_);
  return cached_bytes_;
}

}  // namespace rattan
