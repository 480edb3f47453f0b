// SPDX-License-Identifier: MIT
#pragma once

// A value in memory as one chunk of the store, so that a later step or run finds it.

#include <cstring>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "engine/core/archive.h"
#include "engine/core/store.h"

namespace rattan {

template <class T>
void write_packed(Store& store, std::string_view field, const T& value) {
  const std::string packed = pack(value);
  auto bytes = std::make_shared<std::vector<std::byte>>(packed.size());
  if (!packed.empty()) {
    std::memcpy(bytes->data(), packed.data(), packed.size());
  }
  store.write_chunk(field, TileId(0), std::move(bytes));
}

template <class T>
void read_packed(Store& store, std::string_view field, T& value) {
  const ChunkBytes bytes = store.read_chunk(field, TileId(0));
  unpack({reinterpret_cast<const char*>(bytes->data()), bytes->size()}, value);
}

}  // namespace rattan
