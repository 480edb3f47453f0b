// SPDX-License-Identifier: MIT
#include "io/store/checksum.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

namespace rattan {

namespace {

constexpr std::uint64_t kOdd1 = 0x9e3779b97f4a7c15ULL;  // 2^64 / golden ratio
constexpr std::uint64_t kOdd2 = 0xd1b54a32d192ed03ULL;

/// A bijection of `state` for each word, and of the word for each state.
std::uint64_t absorb(std::uint64_t state, std::uint64_t word) {
  return std::rotl(state ^ (word * kOdd1), 29) * kOdd2;
}

std::uint64_t scramble(std::uint64_t x) {
  x = (x ^ (x >> 32)) * kOdd1;
  x = (x ^ (x >> 29)) * kOdd2;
  return x ^ (x >> 32);
}

}  // namespace

std::uint64_t checksum(std::span<const std::byte> bytes, std::uint64_t seed) {
  // Four independent lanes keep the multipliers busy.
  std::array<std::uint64_t, 4> lanes;
  for (std::size_t l = 0; l < lanes.size(); ++l) {
    lanes[l] = scramble(seed + l * kOdd2 + 1);
  }
  const std::byte* at = bytes.data();
  std::size_t left = bytes.size();
  for (; left >= 32; left -= 32, at += 32) {
    std::array<std::uint64_t, 4> words;
    std::memcpy(words.data(), at, 32);
    for (std::size_t l = 0; l < lanes.size(); ++l) {
      lanes[l] = absorb(lanes[l], words[l]);
    }
  }
  for (std::size_t l = 0; left > 0; ++l) {
    std::uint64_t word = 0;
    const std::size_t take = std::min<std::size_t>(8, left);
    std::memcpy(&word, at, take);
    lanes[l] = absorb(lanes[l], word);
    at += take;
    left -= take;
  }
  std::uint64_t result = scramble(bytes.size() ^ seed);
  for (const std::uint64_t lane : lanes) {
    result = scramble(absorb(result, lane));
  }
  return result;
}

}  // namespace rattan
