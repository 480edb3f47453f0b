// SPDX-License-Identifier: MIT
#include "engine/core/memory_store.h"

namespace rattan {

void MemoryStore::write_chunk(std::string_view field, TileId tile, ChunkBytes bytes) {
  const std::scoped_lock lock(mutex_);
  chunks_[{std::string(field), tile}] = std::move(bytes);
}

ChunkBytes MemoryStore::read_chunk(std::string_view field, TileId tile) {
  const std::scoped_lock lock(mutex_);
  const auto found = chunks_.find({std::string(field), tile});
  if (found == chunks_.end()) {
    throw InternalError("chunk " + std::to_string(tile.value) + " of " + std::string(field) +
                        " is read before it was written");
  }
  return found->second;
}

bool MemoryStore::has_chunk(std::string_view field, TileId tile) const {
  const std::scoped_lock lock(mutex_);
  return chunks_.contains({std::string(field), tile});
}

void MemoryStore::erase(std::string_view field) {
  const std::scoped_lock lock(mutex_);
  const std::string name(field);
  auto first = chunks_.lower_bound({name, TileId(0)});
  auto last = first;
  while (last != chunks_.end() && last->first.first == name) {
    ++last;
  }
  chunks_.erase(first, last);
}

}  // namespace rattan
