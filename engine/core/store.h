// SPDX-License-Identifier: MIT
#pragma once

// The engine's only way to data of scan length: arrays named "stage/field", one chunk per tile.
// io/ implements it over HDF5 with a cache; memory_store.h is the implementation without a disk.

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "engine/core/errors.h"
#include "engine/core/types.h"

namespace rattan {

/// Immutable bytes of one chunk, shared between the cache and its readers (the pin is the pointer).
using ChunkBytes = std::shared_ptr<const std::vector<std::byte>>;

/// Thread safe. A chunk is written whole and replaces what was there.
class Store {
 public:
  virtual ~Store() = default;
  virtual void write_chunk(std::string_view field, TileId tile, ChunkBytes bytes) = 0;
  /// Throws InternalError if the chunk was never written.
  virtual ChunkBytes read_chunk(std::string_view field, TileId tile) = 0;
  virtual bool has_chunk(std::string_view field, TileId tile) const = 0;
  /// Drops all chunks of the field; nothing happens if there are none.
  virtual void erase(std::string_view field) = 0;
};

/// A typed name: Field<Vec3f> kNormal{"geometry/normal"}.
template <class T>
struct Field {
  static_assert(std::is_trivially_destructible_v<T>);
  std::string_view name;
};

/// A typed, pinned, read-only chunk. Copies share the bytes.
template <class T>
class ChunkView {
 public:
  ChunkView() = default;
  explicit ChunkView(ChunkBytes bytes) : bytes_(std::move(bytes)) {
    ensure(bytes_->size() % sizeof(T) == 0, "a chunk holds whole records");
  }
  std::span<const T> span() const {
    return bytes_ ? std::span<const T>(reinterpret_cast<const T*>(bytes_->data()),
                                       bytes_->size() / sizeof(T))
                  : std::span<const T>{};
  }
  const T& operator[](std::size_t i) const { return span()[i]; }
  std::size_t size() const { return span().size(); }
  auto begin() const { return span().begin(); }
  auto end() const { return span().end(); }

 private:
  ChunkBytes bytes_;
};

template <class T>
ChunkView<T> read(Store& store, Field<T> field, TileId tile) {
  return ChunkView<T>(store.read_chunk(field.name, tile));
}

template <class T>
void write(Store& store, Field<T> field, TileId tile, std::span<const T> values) {
  // Copied as they are made, so that nothing is zeroed first.
  const auto* first = reinterpret_cast<const std::byte*>(values.data());
  store.write_chunk(
      field.name, tile,
      std::make_shared<const std::vector<std::byte>>(first, first + values.size_bytes()));
}

template <class T>
void write(Store& store, Field<T> field, TileId tile, const std::vector<T>& values) {
  write(store, field, tile, std::span<const T>(values));
}

}  // namespace rattan
