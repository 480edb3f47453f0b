// SPDX-License-Identifier: MIT
#include "engine/core/spool.h"

#include <numeric>

#include <gtest/gtest.h>

#include "engine/core/memory_store.h"

namespace rattan {
namespace {

TEST(Spool, GivesBackWhatItGotInOrder) {
  MemoryStore store;
  for (const std::size_t block_bytes : {std::size_t{1}, std::size_t{100}, kSpoolBlockBytes}) {
    for (const std::size_t n : {0U, 1U, 24U, 25U, 26U, 1000U}) {
      std::vector<std::uint32_t> values(n);
      std::iota(values.begin(), values.end(), 5U);
      Spool<std::uint32_t> spool(store, "test/spool", block_bytes);
      const std::span<const std::uint32_t> all(values);
      spool.append(all.first(n / 3));
      for (std::size_t i = n / 3; i < n / 2; ++i) {
        spool.push(values[i]);
      }
      spool.append(all.subspan(n / 2));
      spool.finish();
      EXPECT_EQ(spool.size(), n);
      std::vector<std::uint32_t> read;
      spool.for_each_block([&](std::span<const std::uint32_t> block) {
        EXPECT_LE(block.size(), spool.block_records());
        read.insert(read.end(), block.begin(), block.end());
      });
      EXPECT_EQ(read, values);
      read.clear();
      for (SpoolReader<std::uint32_t> reader(spool); !reader.done();) {
        if (read.size() % 3 == 0) {
          read.push_back(reader.front());
          reader.pop();
        } else {
          const auto rest = reader.rest();
          const std::size_t take = (rest.size() + 1) / 2;
          read.insert(read.end(), rest.begin(), rest.begin() + take);
          reader.skip(take);
        }
      }
      EXPECT_EQ(read, values);
    }
    EXPECT_FALSE(store.has_chunk("test/spool", TileId(0)));
  }
}

TEST(Spool, MovingLeavesTheChunksToTheNewOwner) {
  MemoryStore store;
  {
    Spool<int> kept = [&] {
      Spool<int> made(store, "test/spool");
      made.push(7);
      made.finish();
      return Spool<int>(std::move(made));
    }();
    EXPECT_EQ(kept.block(0)[0], 7);
    kept.erase();
    EXPECT_EQ(kept.size(), 0U);
    kept.push(8);
    kept.finish();
    EXPECT_EQ(kept.block(0)[0], 8);
  }
  EXPECT_FALSE(store.has_chunk("test/spool", TileId(0)));
}

}  // namespace
}  // namespace rattan
