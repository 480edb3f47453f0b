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
constexpr std::uint64_t kBytesPerVertex = 10;
constexpr double kBytesPerFace = 1000.0;
constexpr int kLeastInFlight = 2;

}  // namespace

int tiles_in_flight(std::uint64_t budget, int threads) {
  const auto most = static_cast<int>(std::min<std::uint64_t>(budget / 4 / kTile, 1U << 20));
  return std::max(kLeastInFlight, std::min(2 * threads + 2, most));
}

std::uint64_t output_bytes(double faces) {
  return static_cast<std::uint64_t>(std::min(kBytesPerFace * std::max(faces, 0.0), 1e18));
}

MemoryNeed memory_need(std::uint64_t vertices, double faces, std::uint64_t budget, int threads) {
  return {.process = kProcess,
          .tiles = static_cast<std::uint64_t>(tiles_in_flight(budget, threads)) * kTile,
          .scan = kBytesPerVertex * vertices,
          .output = output_bytes(faces)};
}

void check_memory(const MemoryNeed& need, std::uint64_t budget, const std::string& scan,
                  double faces) {
  if (need.total() <= budget) {
    return;
  }
  const std::uint64_t whole = (need.total() + kMiB - 1) / kMiB;
  throw ResourceError(fmt::format(
      "{}: a memory budget of {} is too small. At least {} are needed: {} for the program, {} for "
      "tiles at work, {} for the scan's tables and {} for a remesh of {:.0f} faces. Allow "
      "--memory {}MiB{}.",
      scan, format_bytes(budget), format_bytes(need.total()), format_bytes(need.process),
      format_bytes(need.tiles), format_bytes(need.scan), format_bytes(need.output), faces, whole,
      need.output > need.total() / 2 ? ", or ask for fewer faces" : ""));
}

}  // namespace rattan
