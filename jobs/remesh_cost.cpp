// SPDX-License-Identifier: MIT
#include "jobs/remesh_cost.h"

#include <algorithm>

namespace rattan {

namespace {

constexpr double kSecondsPerTriangle = 3.6e-6;
constexpr double kSecondsPerFace = 20e-6;
constexpr double kLayoutSecondsPerTriangle = 6.5e-6;
constexpr double kSecondsPerRun = 0.03;
constexpr double kParallelShare = 0.93;
constexpr double kDiskBytesPerSecond = 4e8;
/// Work that goes to disk and back, in multiples of what doesn't fit into memory.
constexpr double kTimesToDisk = 3.0;

}  // namespace

double remesh_cpu_seconds(double triangles, double faces, double sizes) {
  return kSecondsPerRun + kSecondsPerTriangle * triangles * sizes + kSecondsPerFace * faces;
}

double layout_cpu_seconds(double triangles) {
  return kSecondsPerRun + kLayoutSecondsPerTriangle * triangles;
}

double remesh_wall_seconds(double cpu_seconds, double threads) {
  return cpu_seconds * (1.0 - kParallelShare + kParallelShare / std::max(threads, 1.0));
}

double remesh_disk_seconds(std::uint64_t whole_scan, std::uint64_t budget) {
  const double outside = static_cast<double>(whole_scan) - static_cast<double>(budget);
  return kTimesToDisk * std::max(outside, 0.0) / kDiskBytesPerSecond;
}

}  // namespace rattan
