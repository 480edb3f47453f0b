// SPDX-License-Identifier: MIT
#include "io/store/checksum.h"

#include <set>
#include <vector>

#include <gtest/gtest.h>

namespace rattan {
namespace {

std::vector<std::byte> sample(std::size_t n) {
  std::vector<std::byte> bytes(n);
  for (std::size_t i = 0; i < n; ++i) {
    bytes[i] = static_cast<std::byte>(i * 37 + i / 251);
  }
  return bytes;
}

TEST(Checksum, EveryFlippedBitAndEveryLengthShows) {
  std::set<std::uint64_t> sums;
  std::size_t expected = 0;
  for (std::size_t n = 0; n < 100; ++n) {
    auto bytes = sample(n);
    sums.insert(checksum(bytes));
    ++expected;
    for (std::size_t bit = 0; bit < 8 * n; ++bit) {
      bytes[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
      sums.insert(checksum(bytes));
      ++expected;
      bytes[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
    }
  }
  EXPECT_EQ(sums.size(), expected);
}

TEST(Checksum, SeedsZerosAndOrderShow) {
  const auto bytes = sample(64);
  EXPECT_NE(checksum(bytes, 1), checksum(bytes, 2));
  const std::vector<std::byte> zeros(64);
  EXPECT_NE(checksum(std::span(zeros).first(8)), checksum(std::span(zeros).first(16)));
  auto swapped = bytes;
  for (std::size_t i = 0; i < 8; ++i) {
    std::swap(swapped[i], swapped[i + 32]);
  }
  EXPECT_NE(checksum(bytes), checksum(swapped));
}

TEST(Checksum, IsPartOfTheFileFormat) {
  // Kept work directories must stay readable.
  EXPECT_EQ(checksum(sample(1000)), 18218578621117095596ULL);
}

}  // namespace
}  // namespace rattan
