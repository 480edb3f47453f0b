// SPDX-License-Identifier: MIT
#include "io/store/hdf5_store.h"

#include <algorithm>
#include <span>
#include <utility>

#include "engine/core/errors.h"
#include "io/store/checksum.h"

namespace rattan {

namespace fs = std::filesystem;

namespace {

constexpr const char* kExtension = ".h5";
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

/// Seeded by where the chunk belongs, so that a chunk in the wrong place is noticed as well.
std::uint64_t chunk_checksum(std::string_view field, std::uint32_t tile, const ChunkBytes& data) {
  return checksum(*data, checksum(std::as_bytes(std::span(field)), tile));
}

}  // namespace

Hdf5Store::Hdf5Store(Hdf5StoreOptions options)
    : options_(std::move(options)), cache_limit_(options_.cache_bytes) {
  std::error_code error;
  std::vector<fs::path> finished;
  for (fs::directory_iterator at(options_.directory, error), end; !error && at != end;
       at.increment(error)) {
    const fs::path& path = at->path();
    if (path.extension() == kExtension) {
      finished.push_back(path);
    } else if (!options_.read_only && path.extension() == StageFile::kPartialSuffix &&
               path.stem().extension() == kExtension) {
      std::error_code ignored;
      fs::remove(path, ignored);  // of a run that was killed
    }
  }
  std::sort(finished.begin(), finished.end());
  for (const fs::path& path : finished) {
    const std::string name = path.stem().string();
    Stage& stage = stages_[name];
    stage.file.emplace(StageFile::open(path));
    stage.complete = true;
    stage.attributes = stage.file->attributes();
    const std::string folder = name + "/";
    for (const auto& [short_name, records] : stage.file->contents()) {
      Field& field = field_of(folder + short_name);
      for (const ChunkRecord& r : records) {
        Entry& e = field.chunks[static_cast<std::uint32_t>(r.tile)];
        e.bytes = e.capacity = r.bytes;
        e.version = next_version_++;
        e.on_disk = true;
        e.offset = r.offset;
        e.checksum = r.checksum;
      }
    }
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
  for (auto& [name, stage] : stages_) {
    if (!stage.file) {
      continue;
    }
    // Partial files delete themselves.
    const bool remove = stage.file->finished() && !options_.keep && !options_.read_only;
    const fs::path path = stage.file->path();
    stage.file.reset();
    if (remove) {
      std::error_code ignored;
      fs::remove(path, ignored);
      may_remove_directory_ = true;
    }
  }
  if (!options_.keep && may_remove_directory_) {
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

fs::path Hdf5Store::path_of(const std::string& stage) const {
  return options_.directory / (stage + kExtension);
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
  f.stage->complete = false;
  Entry& e = f.chunks[tile.value];
  drop_data(e);
  e.bytes = bytes->size();
  e.data = std::move(bytes);
  e.version = next_version_++;
  e.on_disk = false;
  cached_bytes_ += e.bytes;
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
      lock.unlock();
      bytes->resize(size);
      path = f.stage->file->path();
      f.stage->file->read(f.short_name, offset, *bytes);
    }
    if (chunk_checksum(field, tile.value, bytes) != expected) {
      throw InputError(path.string(),
                       "chunk " + std::to_string(tile.value) + " of " + std::string(field),
                       "the data do not match their checksum",
                       "The file is damaged; delete the work directory and run again");
    }
    lock.lock();
    bytes_read_ += bytes->size();
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
  if (stage.file && !stage.file->finished()) {
    stage.file->erase_field(f->second.short_name);
  }
  fields_.erase(f);
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
    const std::uint64_t sum = chunk_checksum(name, tile, data);
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
  if (!stage.file) {
    std::error_code error;
    if (fs::create_directories(options_.directory, error)) {
      may_remove_directory_ = true;
    }
    if (error) {
      throw ResourceError(options_.directory.string() + ": cannot be created (" + error.message() +
                          "). Choose another directory with --work-dir.");
    }
    stage.file.emplace(StageFile::create(path_of(name)));
  } else if (stage.file->finished()) {
    stage.file->resume();
  }
  return *stage.file;
}

void Hdf5Store::write_out(Field& field, std::uint32_t tile, std::uint64_t version,
                          const ChunkBytes& data, std::uint64_t sum) {
  std::uint64_t offset = 0;
  std::uint64_t capacity = 0;
  {
    const std::scoped_lock lock(mutex_);
    const Entry& e = field.chunks.find(tile)->second;
    offset = e.offset;
    capacity = e.capacity;
  }
  StageFile& file = writable_file(field.stage_name, *field.stage);
  if (data->size() <= capacity) {
    file.overwrite(field.short_name, offset, *data);
  } else {
    offset = file.append(field.short_name, *data);
    capacity = data->size();
  }
  const std::scoped_lock lock(mutex_);
  bytes_written_ += data->size();
  Entry& e = field.chunks.find(tile)->second;
  e.offset = offset;
  e.capacity = capacity;
  if (e.version == version) {
    e.on_disk = true;
    e.checksum = sum;
  }
}

void Hdf5Store::set_attribute(std::string_view stage, const std::string& name, std::string value) {
  const std::scoped_lock lock(mutex_);
  Stage& s = stages_[std::string(stage)];
  s.complete = false;
  s.attributes[name] = std::move(value);
}

std::optional<std::string> Hdf5Store::attribute(std::string_view stage,
                                                const std::string& name) const {
  const std::scoped_lock lock(mutex_);
  const auto s = stages_.find(stage);
  if (s == stages_.end()) {
    return std::nullopt;
  }
  const auto a = s->second.attributes.find(name);
  return a == s->second.attributes.end() ? std::nullopt : std::optional(a->second);
}

void Hdf5Store::complete_stage(std::string_view stage) {
  const std::scoped_lock io(io_mutex_);
  std::unique_lock lock(mutex_);
  const std::string name(stage);
  Stage& s = stages_[name];
  if (s.complete) {
    return;
  }
  if (!options_.keep) {
    s.complete = true;
    return;
  }
  struct Dirty {
    std::uint32_t tile;
    std::uint64_t version;
    ChunkBytes data;
  };
  std::map<std::string, Field*> fields;
  for (auto& [field_name, field] : fields_) {
    if (field.stage == &s) {
      fields.emplace(field.short_name, &field);
    }
  }
  lock.unlock();
  // In a fixed order, so that equal work gives equal files.
  for (auto& [short_name, field] : fields) {
    lock.lock();
    std::vector<Dirty> dirty;
    for (const auto& [tile, e] : field->chunks) {
      if (!e.on_disk) {
        dirty.push_back({tile, e.version, e.data});
      }
    }
    lock.unlock();
    std::sort(dirty.begin(), dirty.end(),
              [](const Dirty& a, const Dirty& b) { return a.tile < b.tile; });
    for (const Dirty& d : dirty) {
      write_out(*field, d.tile, d.version, d.data, chunk_checksum(field->name, d.tile, d.data));
    }
  }
  StageFile& file = writable_file(name, s);
  lock.lock();
  StageFile::Contents contents;
  for (const auto& [short_name, field] : fields) {
    auto& records = contents[short_name];
    for (const auto& [tile, e] : field->chunks) {
      ensure(e.on_disk, "nothing writes to a stage while it is being completed");
      records.push_back({tile, e.offset, e.bytes, e.checksum});
    }
    std::sort(records.begin(), records.end(),
              [](const ChunkRecord& a, const ChunkRecord& b) { return a.tile < b.tile; });
  }
  StageFile::Attributes attributes = s.attributes;
  lock.unlock();
  file.finish(std::move(contents), std::move(attributes));
  lock.lock();
  s.complete = true;
}

void Hdf5Store::set_keep(bool keep) {
  const std::scoped_lock io(io_mutex_);
  const std::scoped_lock lock(mutex_);
  options_.keep = keep;
}

bool Hdf5Store::is_complete(std::string_view stage) const {
  const std::scoped_lock lock(mutex_);
  const auto s = stages_.find(stage);
  return s != stages_.end() && s->second.complete;
}

void Hdf5Store::discard_stage(std::string_view stage) {
  ensure(!options_.read_only, "a store opened for reading is not written");
  const std::scoped_lock io(io_mutex_);
  const std::scoped_lock lock(mutex_);
  const auto s = stages_.find(stage);
  if (s == stages_.end()) {
    return;
  }
  for (auto f = fields_.begin(); f != fields_.end();) {
    if (f->second.stage == &s->second) {
      for (auto& [tile, entry] : f->second.chunks) {
        drop_data(entry);
      }
      f = fields_.erase(f);
    } else {
      ++f;
    }
  }
  if (s->second.file) {
    const fs::path path = s->second.file->path();
    s->second.file.reset();
    std::error_code ignored;
    fs::remove(path, ignored);
  }
  stages_.erase(s);
}

std::vector<StoredStage> Hdf5Store::list() const {
  const std::scoped_lock io(io_mutex_);
  const std::scoped_lock lock(mutex_);
  std::map<std::string, StoredStage> stages;
  for (const auto& [name, stage] : stages_) {
    StoredStage& s = stages[name];
    s.name = name;
    s.complete = stage.complete;
    s.attributes = stage.attributes;
    if (stage.file) {
      std::error_code error;
      const std::uintmax_t size = fs::file_size(stage.file->path(), error);
      s.file_bytes = error ? 0 : size;
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

std::uint64_t Hdf5Store::cached_bytes() const {
  const std::scoped_lock lock(mutex_);
  return cached_bytes_;
}

}  // namespace rattan
