// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <mutex>
#include <utility>

#include "engine/core/store.h"

namespace rattan {

/// A store without a disk, for tests and for small helpers.
class MemoryStore final : public Store {
 public:
  void write_chunk(std::string_view field, TileId tile, ChunkBytes bytes) override;
  ChunkBytes read_chunk(std::string_view field, TileId tile) override;
  bool has_chunk(std::string_view field, TileId tile) const override;
  void erase(std::string_view field) override;

 private:
  mutable std::mutex mutex_;
  std::map<std::pair<std::string, TileId>, ChunkBytes> chunks_;
};

}  // namespace rattan
