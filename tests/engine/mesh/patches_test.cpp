// SPDX-License-Identifier: MIT
#include "engine/mesh/patches.h"

#include <random>

#include <gtest/gtest.h>

namespace rattan {
namespace {

TEST(ParityUnionFind, AgreesWithAPotential) {
  // Parities that come from a hidden colouring never contradict; a wrong one always does.
  constexpr std::uint32_t kSize = 500;
  std::mt19937 random(11);
  std::vector<std::uint32_t> colour(kSize);
  for (auto& c : colour) {
    c = random() % 2;
  }
  ParityUnionFind sets(kSize);
  for (int k = 0; k < 2000; ++k) {
    const std::uint32_t a = random() % kSize;
    const std::uint32_t b = random() % kSize;
    EXPECT_TRUE(sets.unite(a, b, colour[a] ^ colour[b]));
    EXPECT_FALSE(sets.unite(a, b, 1 ^ colour[a] ^ colour[b]));
    const auto [ra, pa] = sets.find(a);
    EXPECT_LE(ra, a);
    EXPECT_EQ(pa, colour[ra] ^ colour[a]);
  }
}

TEST(PatchJoiner, TheMajorityOfAComponentDecides) {
  PatchJoiner joiner;
  EXPECT_EQ(joiner.add({{.plain = 10, .turned = 1}, {.plain = 0, .turned = 30}}), 0U);
  EXPECT_EQ(joiner.add({{.plain = 3, .turned = 3, .first_parity = 1}}), 2U);
  joiner.begin_joining();
  joiner.join(0 << 1 | 0, 1 << 1 | 0);
  const auto fates = joiner.resolve();
  EXPECT_EQ(joiner.components(), 2U);
  EXPECT_FALSE(joiner.any_one_sided());
  EXPECT_TRUE(fates[0].flip);  // 31 of 41 are turned
  EXPECT_TRUE(fates[1].flip);
  EXPECT_TRUE(fates[2].flip);  // a tie goes to the first triangle
}

TEST(PatchJoiner, AContradictionMakesTheComponentOneSided) {
  PatchJoiner joiner;
  joiner.add({{.plain = 1}, {.plain = 1}, {.plain = 1}});
  joiner.begin_joining();
  joiner.join(0 << 1 | 0, 1 << 1 | 0);
  joiner.join(0 << 1 | 0, 1 << 1 | 1);
  const auto fates = joiner.resolve();
  EXPECT_TRUE(joiner.any_one_sided());
  EXPECT_TRUE(fates[0].one_sided && fates[1].one_sided);
  EXPECT_FALSE(fates[2].one_sided);
}

}  // namespace
}  // namespace rattan
