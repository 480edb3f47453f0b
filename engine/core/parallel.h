// SPDX-License-Identifier: MIT
#pragma once

// Deterministic parallel loops over arrays in memory. Chunk borders depend on the length alone, so
// reductions give the same bits for any number of threads.

#include <algorithm>
#include <cstddef>
#include <vector>

#include <oneapi/tbb/parallel_for.h>

#include "engine/core/hand_over.h"

namespace rattan {

inline constexpr std::size_t kParallelGrain = 4096;

/// f(begin, end) on fixed chunks of [0, n).
template <class F>
void parallel_chunks(std::size_t n, const F& f, std::size_t grain = kParallelGrain) {
  const std::size_t chunks = (n + grain - 1) / grain;
  if (chunks <= 1) {
    if (n > 0) {
      f(std::size_t{0}, n);
    }
    return;
  }
  HandOver begun;
  HandOver ended;
  begun.give();
  oneapi::tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t c) {
    begun.take();
    f(c * grain, std::min(n, (c + 1) * grain));
    ended.give();
  });
  ended.take();
}

/// f(i) for i in [0, n).
template <class F>
void parallel_indices(std::size_t n, const F& f, std::size_t grain = kParallelGrain) {
  parallel_chunks(
      n,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          f(i);
        }
      },
      grain);
}

/// Sum over chunks of f(begin, end) -> T, added in chunk order.
template <class T, class F>
T parallel_sum(std::size_t n, T zero, const F& f, std::size_t grain = kParallelGrain) {
  const std::size_t chunks = (n + grain - 1) / grain;
  std::vector<T> partial(chunks, zero);
  parallel_chunks(
      n, [&](std::size_t begin, std::size_t end) { partial[begin / grain] = f(begin, end); },
      grain);
  T sum = zero;
  for (const T& p : partial) {
    sum += p;
  }
  return sum;
}

}  // namespace rattan
