// SPDX-License-Identifier: MIT
#pragma once

// SHA-256 (FIPS 180-4), incremental. By the processor's SHA instructions where it has them, else in
// plain C++ at about the speed of a disk; the same digest either way.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace rattan {

class Sha256 {
 public:
  Sha256();
  /// Without the processor's SHA instructions.
  struct Plain {};
  explicit Sha256(Plain) {}
  void update(std::span<const std::byte> bytes);
  /// Digest of everything given so far. The object must not be updated afterwards.
  std::array<std::uint8_t, 32> digest();
  /// The digest as 64 lower-case hexadecimal digits.
  std::string hex_digest();

 private:
  void compress(const std::uint8_t* block, std::size_t blocks);

  std::array<std::uint32_t, 8> state_{0x6a09e667U, 0xbb67ae85U, 0x3c6ef372U, 0xa54ff53aU,
                                      0x510e527fU, 0x9b05688cU, 0x1f83d9abU, 0x5be0cd19U};
  std::array<std::uint8_t, 64> pending_{};
  std::size_t pending_bytes_ = 0;
  std::uint64_t total_bytes_ = 0;
  bool in_hardware_ = false;
};

}  // namespace rattan
