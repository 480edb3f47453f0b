// SPDX-License-Identifier: MIT
#include "engine/mesh/external_sort.h"

#include <algorithm>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "engine/core/memory_store.h"

namespace rattan {
namespace {

struct Record {
  std::uint64_t key;
  std::uint64_t id;
  friend bool operator==(const Record&, const Record&) = default;
};
struct KeyOf {
  std::uint64_t operator()(const Record& r) const { return r.key; }
};

std::vector<Record> random_records(std::size_t n, std::uint64_t mask) {
  std::mt19937_64 random(7);
  std::vector<Record> records;
  for (std::size_t i = 0; i < n; ++i) {
    records.push_back({random() & mask, i});
  }
  return records;
}

TEST(RadixSort, IsAStableSort) {
  for (const std::uint64_t mask : {~0ULL, 0xffULL, 0xff00000000000000ULL, 0x0ULL}) {
    auto records = random_records(200000, mask);
    auto expected = records;
    std::stable_sort(expected.begin(), expected.end(),
                     [](const Record& a, const Record& b) { return a.key < b.key; });
    std::vector<Record> scratch;
    radix_sort(records, scratch, KeyOf{});
    EXPECT_EQ(records, expected);
  }
}

TEST(ExternalSort, AnyBufferGivesTheStableOrder) {
  const auto records = random_records(20000, 0x3ff);
  auto expected = records;
  std::stable_sort(expected.begin(), expected.end(),
                   [](const Record& a, const Record& b) { return a.key < b.key; });
  for (const std::size_t memory : {std::size_t{1}, std::size_t{5000}, std::size_t{1} << 30}) {
    MemoryStore store;
    ExternalSort<Record, KeyOf> sort(store, "test/run_", KeyOf{}, memory, 0);
    sort.push(std::span<const Record>(records).first(7777));
    for (std::size_t i = 7777; i < records.size(); ++i) {
      sort.push(records[i]);
    }
    for (int round = 0; round < 2; ++round) {
      sort.finish();
      EXPECT_EQ(sort.run_count() == 0, memory == std::size_t{1} << 30);
      std::vector<Record> sorted;
      while (!sort.done() && sort.front().key < 500) {
        sorted.push_back(sort.front());
        sort.pop();
      }
      for (std::uint64_t key = 500; key <= 0x3ff; ++key) {
        sort.take_key(key, sorted);
      }
      EXPECT_TRUE(sort.done());
      EXPECT_EQ(sorted, expected);
    }
  }
}

TEST(ExternalSort, NothingIsSorted) {
  MemoryStore store;
  ExternalSort<Record, KeyOf> sort(store, "test/run_", KeyOf{}, 100, 0);
  sort.finish();
  EXPECT_TRUE(sort.done());
}

}  // namespace
}  // namespace rattan
