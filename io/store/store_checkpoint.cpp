// SPDX-License-Identifier: MIT
// The store's checkpoints: what is taken up when it opens, and what is saved. The cache and its
// traffic with the files are in hdf5_store.cpp.
#include <algorithm>
#include <utility>

#include "engine/core/errors.h"
#include "io/store/checksum.h"
#include "io/store/hdf5_store.h"

namespace rattan {

namespace fs = std::filesystem;

void Hdf5Store::take_up() {
  StoreRecord record;
  try {
    if (std::optional<StoreRecord> found = read_record(options_.directory)) {
      record = std::move(*found);
      has_checkpoint_ = true;
    }
  } catch (const DamagedFile& e) {
    if (options_.read_only) {
      throw;
    }
    damage_.emplace_back(e.what());
    std::error_code ignored;
    fs::remove(e.path(), ignored);
    may_remove_directory_ = true;
  }
  if (has_checkpoint_) {
    open_checkpoint(record);
  }
  if (!options_.read_only) {
    delete_leftovers(record);
  }
}

void Hdf5Store::open_checkpoint(const StoreRecord& record) {
  may_remove_directory_ = true;
  number_ = record.number;
  next_version_ = record.versions + 1;
  notes_ = record.notes;
  std::vector<StageFile*> files;
  std::vector<StageFile::Contents> contents;
  for (const auto& [name, seal] : record.files) {
    StageFile* opened = nullptr;
    try {
      std::unique_ptr<StageFile> file = StageFile::open(options_.directory / name);
      if (file->seal_sum() != seal) {
        throw DamagedFile(options_.directory / name, "", "another file is in its place");
      }
      opened = file.get();
      contents.push_back(file->take_contents());
      stages_[name.substr(0, name.find('.'))].sealed.push_back(std::move(file));
    } catch (const DamagedFile& e) {
      if (options_.read_only) {
        throw;
      }
      damage_.emplace_back(e.what());
      contents.emplace_back();
      std::error_code ignored;
      fs::remove(e.path(), ignored);
    }
    files.push_back(opened);
  }
  for (const StoreRecord::LiveField& live : record.fields) {
    if (std::any_of(live.files.begin(), live.files.end(),
                    [&](std::uint32_t f) { return files.at(f) == nullptr; })) {
      continue;
    }
    Field& field = field_of(live.name);
    field.changed = live.changed;
    for (const std::uint32_t f : live.files) {
      for (const ChunkRecord& r : contents[f][field.short_name]) {
        Entry& e = field.chunks[static_cast<std::uint32_t>(r.tile)];
        e.bytes = e.capacity = r.bytes;
        e.version = next_version_++;
        e.on_disk = true;
        e.file = files[f];
        e.offset = r.offset;
        e.checksum = r.checksum;
      }
    }
  }
}

void Hdf5Store::delete_leftovers(const StoreRecord& record) {
  std::error_code error;
  std::vector<fs::path> leftovers;
  for (fs::directory_iterator at(options_.directory, error), end; !error && at != end;
       at.increment(error)) {
    const fs::path& path = at->path();
    const std::string name = path.filename().string();
    const bool partial = path.extension() == StageFile::kPartialSuffix &&
                         (path.stem().extension() == StageFile::kExtension ||
                          path.stem() == fs::path(StoreRecord::kFileName));
    const bool data = path.extension() == StageFile::kExtension && path.stem().has_extension() &&
                      std::none_of(record.files.begin(), record.files.end(),
                                   [&](const StoreRecord::File& f) { return f.name == name; });
    if (partial || data) {
      leftovers.push_back(path);
    }
  }
  for (const fs::path& path : leftovers) {
    std::error_code ignored;
    fs::remove(path, ignored);
    may_remove_directory_ = true;
  }
}

void Hdf5Store::delete_everything() {
  // The record first: without it, the files count for nothing.
  std::error_code ignored;
  fs::remove(options_.directory / StoreRecord::kFileName, ignored);
  has_checkpoint_ = false;
  delete_leftovers({});
}

std::vector<Hdf5Store::Field*> Hdf5Store::fields_of(const Stage& stage) {
  std::vector<Field*> fields;
  for (auto& [name, field] : fields_) {
    if (field.stage == &stage) {
      fields.push_back(&field);
    }
  }
  std::sort(fields.begin(), fields.end(),
            [](const Field* a, const Field* b) { return a->name < b->name; });
  return fields;
}

// In a fixed order, so that equal work gives equal files.
void Hdf5Store::write_unsaved(Stage& stage) {
  struct Unsaved {
    std::uint32_t tile;
    std::uint64_t version;
    ChunkBytes data;
  };
  for (Field* field : fields_of(stage)) {
    std::vector<Unsaved> unsaved;
    {
      const std::scoped_lock lock(mutex_);
      for (const auto& [tile, e] : field->chunks) {
        if (!e.on_disk) {
          unsaved.push_back({tile, e.version, e.data});
        }
      }
    }
    std::sort(unsaved.begin(), unsaved.end(),
              [](const Unsaved& a, const Unsaved& b) { return a.tile < b.tile; });
    for (const Unsaved& u : unsaved) {
      write_out(*field, u.tile, u.version, u.data, chunk_checksum(field->name, u.tile, *u.data));
    }
  }
}

void Hdf5Store::seal(Stage& stage) {
  StageFile::Contents contents;
  for (const Field* field : fields_of(stage)) {
    for (const auto& [tile, e] : field->chunks) {
      ensure(e.on_disk, "nothing writes to the store during a checkpoint");
      if (e.file == stage.open.get()) {
        contents[field->short_name].push_back({tile, e.offset, e.bytes, e.checksum});
      }
    }
  }
  if (contents.empty()) {
    stage.open.reset();  // all that it held was erased or replaced
    return;
  }
  for (auto& [name, records] : contents) {
    std::sort(records.begin(), records.end(),
              [](const ChunkRecord& a, const ChunkRecord& b) { return a.tile < b.tile; });
  }
  stage.open->seal(contents);
  stage.sealed.push_back(std::move(stage.open));
}

void Hdf5Store::checkpoint() {
  ensure(!options_.read_only, "a store opened for reading is not written");
  settle();
  const std::scoped_lock io(io_mutex_);
  if (!options_.keep) {
    return;
  }
  std::map<std::string, Stage*> stages;
  for (auto& [name, stage] : stages_) {
    stages.emplace(name, &stage);
  }
  std::vector<std::shared_ptr<StageFile>> written;
  std::vector<std::shared_ptr<StageFile>> dead;
  StoreRecord record;
  std::map<const StageFile*, std::uint32_t> file_number;
  for (auto& [name, stage] : stages) {
    write_unsaved(*stage);
    if (stage->open) {
      try {
        seal(*stage);
      } catch (const DiskFull& full) {
        refuse(full);
      }
      if (!stage->open && !stage->sealed.empty() && !stage->sealed.back()->committed()) {
        written.push_back(stage->sealed.back());
      }
    }
    std::map<const StageFile*, bool> used;
    for (const Field* field : fields_of(*stage)) {
      for (const auto& [tile, e] : field->chunks) {
        used[e.file] = true;
      }
    }
    std::erase_if(stage->sealed, [&](const std::shared_ptr<StageFile>& file) {
      if (!used.contains(file.get())) {
        dead.push_back(file);
        dying_bytes_ += file->bytes();
        return true;
      }
      file_number[file.get()] = static_cast<std::uint32_t>(record.files.size());
      record.files.push_back({file->name(), file->seal_sum()});
      return false;
    });
    for (const Field* field : fields_of(*stage)) {
      StoreRecord::LiveField live{field->name, field->changed, {}};
      for (const auto& [tile, e] : field->chunks) {
        live.files.push_back(file_number.at(e.file));
      }
      std::sort(live.files.begin(), live.files.end());
      live.files.erase(std::unique(live.files.begin(), live.files.end()), live.files.end());
      record.fields.push_back(std::move(live));
    }
  }
  record.number = ++number_;
  {
    const std::scoped_lock lock(mutex_);
    record.versions = next_version_;
    record.notes = notes_;
  }
  std::error_code ignored;
  if (fs::create_directories(options_.directory, ignored)) {
    may_remove_directory_ = true;
  }
  committing_ = std::async(
      std::launch::async, [this, record = std::move(record), written = std::move(written),
                           dead = std::move(dead)]() mutable {
        for (const auto& file : written) {
          file->commit();
        }
        sync_path(options_.directory);  // no record of files whose names may be lost
        write_record(options_.directory, record);
        has_checkpoint_ = true;
        for (const auto& file : dead) {
          file->discard();
        }
        dead.clear();
        dying_bytes_ = 0;
      });
}

void Hdf5Store::settle() {
  std::future<void> committing;
  {
    const std::scoped_lock io(io_mutex_);
    committing = std::move(committing_);
  }
  if (committing.valid()) {
    try {
      committing.get();
    } catch (const DiskFull& full) {
      refuse(full);
    }
  }
}

}  // namespace rattan
