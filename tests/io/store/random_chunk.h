// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include "engine/core/store.h"

namespace rattan::test {

/// Bytes that the seed decides.
inline ChunkBytes chunk(std::uint32_t seed, std::size_t size) {
  auto bytes = std::make_shared<std::vector<std::byte>>(size);
  std::mt19937 random(seed);
  for (std::byte& b : *bytes) {
    b = static_cast<std::byte>(random());
  }
  return bytes;
}

}  // namespace rattan::test
