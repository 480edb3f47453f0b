// SPDX-License-Identifier: MIT
#include "jobs/size_plan.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace rattan {

namespace {

constexpr int kMostLines = 4;
// Half of what a size may miss its target by: the coarser mesh may miss its own.
constexpr double kMostMiss = 0.07;

}  // namespace

std::vector<PlannedSize> plan_sizes(std::span<const double> faces, int density) {
  const std::size_t n = faces.size();
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return faces[a] < faces[b]; });
  std::vector<PlannedSize> planned(n);
  std::vector<bool> owns(n, false);
  for (std::size_t i = n; i-- > 0;) {
    PlannedSize& fine = planned[order[i]];
    fine.size = order[i];
    // An owner needs its own solve. The fewest lines are the best, then the nearest count.
    double best_miss = kMostMiss;
    for (std::size_t k = i; k-- > 0 && !owns[fine.size];) {
      const double ratio = faces[fine.size] / faces[order[k]];
      const int multiple = static_cast<int>(std::floor(std::sqrt(ratio) + 0.5));
      if (multiple * density > kMostLines || (fine.owner && multiple > fine.multiple)) {
        break;
      }
      const double miss = std::abs(multiple * multiple / ratio - 1.0);
      if (multiple >= 2 && miss < best_miss) {
        best_miss = miss;
        fine.owner = order[k];
        fine.multiple = multiple;
      }
    }
    if (fine.owner) {
      owns[*fine.owner] = true;
    }
  }
  std::vector<PlannedSize> result;
  for (const std::size_t coarse : order) {
    if (planned[coarse].owner) {
      continue;
    }
    result.push_back(planned[coarse]);
    for (const std::size_t fine : order) {
      if (planned[fine].owner == coarse) {
        result.push_back(planned[fine]);
      }
    }
  }
  return result;
}

}  // namespace rattan
