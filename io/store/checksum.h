// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace rattan {

/// 64-bit checksum against damage, not against malice. Any change within one aligned group of eight
/// bytes changes it; other changes escape with probability 2^-64. About 10 GB/s.
std::uint64_t checksum(std::span<const std::byte> bytes, std::uint64_t seed = 0);

/// Seeded by where the chunk belongs, so that a chunk in the wrong place is noticed as well.
inline std::uint64_t chunk_checksum(std::string_view field, std::uint32_t tile,
                                    std::span<const std::byte> data) {
  return checksum(data, checksum(std::as_bytes(std::span(field)), tile));
}

}  // namespace rattan
