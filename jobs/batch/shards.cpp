// SPDX-License-Identifier: MIT
#include "jobs/batch/shards.h"

// Based on: R. L. Graham, Bounds on Multiprocessing Timing Anomalies, 1969 (longest processing time
// first).

#include <algorithm>
#include <cstddef>
#include <functional>
#include <numeric>
#include <queue>
#include <tuple>
#include <utility>

#include "engine/core/errors.h"

namespace rattan {

std::vector<std::uint32_t> pack(std::span<const double> costs, std::uint32_t parts) {
  ensure(parts > 0, "a batch is packed into one part at least");
  std::vector<std::size_t> order(costs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return costs[a] > costs[b]; });
  // Sum, number of scans, part: scans that cost nothing are spread, too.
  using Load = std::tuple<double, std::size_t, std::uint32_t>;
  std::priority_queue<Load, std::vector<Load>, std::greater<>> loads;
  for (std::uint32_t part = 0; part < parts; ++part) {
    loads.emplace(0.0, 0, part);
  }
  std::vector<std::uint32_t> part_of(costs.size());
  for (const std::size_t item : order) {
    const auto [sum, count, part] = loads.top();
    loads.pop();
    part_of[item] = part;
    loads.emplace(sum + costs[item], count + 1, part);
  }
  return part_of;
}

}  // namespace rattan
