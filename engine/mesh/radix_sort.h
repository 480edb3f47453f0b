// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/core/parallel.h"

namespace rattan {

/// Stable sort of `records` by key(record) -> std::uint64_t, with `scratch` as the second buffer
/// (its contents are lost). Parallel; the result is that of any stable sort. Memory: both arrays
/// and 16 KiB per 64 thousand records at most 16 times.
template <class Record, class Key>
void radix_sort(std::vector<Record>& records, std::vector<Record>& scratch, const Key& key) {
  constexpr int kBits = 11;
  constexpr std::size_t kBins = std::size_t{1} << kBits;
  const std::size_t n = records.size();
  if (n < 2) {
    return;
  }
  const std::size_t grain = std::max<std::size_t>(std::size_t{1} << 16, (n + 15) / 16);
  const std::size_t chunks = (n + grain - 1) / grain;

  // Bits in which keys differ: digits without any are skipped.
  const std::uint64_t first = key(records[0]);
  std::vector<std::uint64_t> differing(chunks, 0);
  parallel_chunks(
      n,
      [&](std::size_t begin, std::size_t end) {
        std::uint64_t d = 0;
        for (std::size_t i = begin; i < end; ++i) {
          d |= key(records[i]) ^ first;
        }
        differing[begin / grain] = d;
      },
      grain);
  std::uint64_t varies = 0;
  for (const std::uint64_t d : differing) {
    varies |= d;
  }

  scratch.resize(n);
  std::vector<std::array<std::size_t, kBins>> bins(chunks);
  for (int shift = 0; shift < 64; shift += kBits) {
    if (((varies >> shift) & (kBins - 1)) == 0) {
      continue;
    }
    const auto digit = [&](const Record& r) { return (key(r) >> shift) & (kBins - 1); };
    parallel_chunks(
        n,
        [&](std::size_t begin, std::size_t end) {
          auto& count = bins[begin / grain];
          count.fill(0);
          for (std::size_t i = begin; i < end; ++i) {
            ++count[digit(records[i])];
          }
        },
        grain);
    std::size_t next = 0;
    for (std::size_t b = 0; b < kBins; ++b) {
      for (std::size_t c = 0; c < chunks; ++c) {
        const std::size_t count = bins[c][b];
        bins[c][b] = next;
        next += count;
      }
    }
    parallel_chunks(
        n,
        [&](std::size_t begin, std::size_t end) {
          auto& at = bins[begin / grain];
          for (std::size_t i = begin; i < end; ++i) {
            scratch[at[digit(records[i])]++] = records[i];
          }
        },
        grain);
    records.swap(scratch);
  }
}

}  // namespace rattan
