// SPDX-License-Identifier: MIT
#pragma once

// What a run takes, as measured on synthetic scans of 1.6 to 100 million triangles, see the README.
// For plans and forecasts: nothing decides by it what comes out.

#include <cstdint>

namespace rattan {

/// Of the scan's fields in use at once.
inline constexpr std::uint64_t kLiveBytesPerVertex = 440;
/// Of a work directory that holds them all.
inline constexpr std::uint64_t kDiskBytesPerVertex = 500;
/// Over the scan, for each size.
inline constexpr int kPassesPerSize = 40;

/// Processor seconds of a run on one thread; `faces` of the largest remesh.
double remesh_cpu_seconds(double triangles, double faces, double sizes);
/// Likewise of a layout.
double layout_cpu_seconds(double triangles);
inline constexpr int kPassesPerLayout = 30;
/// Triangles of a layout for each of the scan's: lines cut each into about two.
inline constexpr std::uint64_t kLayoutTriangles = 2;
/// Wall seconds of so many processor seconds on so many threads.
double remesh_wall_seconds(double cpu_seconds, double threads);
/// Wall seconds that are spent on what doesn't fit into memory.
double remesh_disk_seconds(std::uint64_t whole_scan, std::uint64_t budget);

}  // namespace rattan
