// SPDX-License-Identifier: MIT
#include "jobs/memory_plan.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "engine/core/errors.h"
#include "engine/core/memory_budget.h"

namespace rattan {

namespace {

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;
constexpr std::uint64_t kProcess = 40 * kMiB;
constexpr std::uint64_t kTile = 4 * kMiB;
constexpr std::uint64_t kBytesPerVertex = 16;
constexpr double kBytesPerFace = 1000.0;
// While charts are found: the lines, and where they meet the rims of tiles. More than the charts'
// graph, the base complex and the transition functions together later.
constexpr double kBytesPerChart = 1100.0;
constexpr double kChartBytesPerVertex = 24.0;
constexpr std::uint64_t kPicture = 120 * kMiB;
constexpr int kLeastInFlight = 2;

std::uint64_t layout_bytes(double charts, std::uint64_t vertices) {
  const double bytes =
      kBytesPerChart * charts + kChartBytesPerVertex * static_cast<double>(vertices);
  return charts > 0.0 ? static_cast<std::uint64_t>(std::min(bytes, 1e18)) : 0;
}

}  // namespace

int tiles_in_flight(std::uint64_t budget, int threads) {
  const auto most = static_cast<int>(std::min<std::uint64_t>(budget / 4 / kTile, 1U << 20));
  return std::max(kLeastInFlight, std::min(2 * threads + 2, most));
}

std::uint64_t output_bytes(double faces) {
  return static_cast<std::uint64_t>(std::min(kBytesPerFace * std::max(faces, 0.0), 1e18));
}

MemoryNeed memory_need(const MemoryWish& wish, std::uint64_t budget) {
  return {.process = kProcess,
          .tiles = static_cast<std::uint64_t>(tiles_in_flight(budget, wish.threads)) * kTile,
          .scan = kBytesPerVertex * wish.vertices,
          .output = output_bytes(wish.faces) + layout_bytes(wish.charts, wish.vertices),
          .picture = wish.picture ? kPicture : 0};
}

std::uint64_t least_budget(const MemoryWish& wish) {
  // More memory lets more tiles be at work, which need more: a few rounds settle it.
  std::uint64_t budget = 0;
  for (;;) {
    const std::uint64_t need = memory_need(wish, budget).total();
    if (need <= budget) {
      return budget;
    }
    budget = (need + kMiB - 1) / kMiB * kMiB;
  }
}

void check_memory(const MemoryWish& wish, std::uint64_t budget, const std::string& scan) {
  const std::uint64_t least = least_budget(wish);
  if (least <= budget) {
    return;
  }
  const MemoryNeed need = memory_need(wish, least);
  const bool layout = wish.charts > 0.0;
  throw ResourceError(fmt::format(
      "{}: a memory budget of {} is too small. At least {} are needed: {} for the program, {} for "
      "tiles at work, {} for the scan's tables{}{}. Allow "
      "--memory {}MiB{}.",
      scan, format_bytes(budget), format_bytes(least), format_bytes(need.process),
      format_bytes(need.tiles), format_bytes(need.scan),
      wish.picture ? fmt::format(", {} for the preview", format_bytes(need.picture)) : "",
      need.output == 0 ? ""
      : layout ? fmt::format(" and {} for a layout of {:.0f} charts", format_bytes(need.output),
                             wish.charts)
               : fmt::format(" and {} for a remesh of {:.0f} faces", format_bytes(need.output),
                             wish.faces),
      least / kMiB,
      need.output <= need.total() / 2 ? ""
      : layout                        ? ", or ask for larger charts"
                                      : ", or ask for fewer faces"));
}

}  // namespace rattan
