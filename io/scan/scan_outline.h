// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

namespace rattan {

/// How large a scan is, as far as the two ends of its file tell.
struct ScanOutline {
  double triangles = 0.0;
  double vertices = 0.0;
  bool counted = false;     ///< by the file itself; else estimated from its size
  bool whole = false;       ///< the format is decoded in memory as one
  std::uint64_t bytes = 0;  ///< of the file
};

/// Counts that the header declares (PLY, OFF, binary STL, Draco), as far as the file's size bears
/// them out; else an estimate from the lines at both ends, or from the size alone. Reads some tens
/// of kilobytes. Never throws for what is in the file, or if there is none: then all is 0.
ScanOutline outline_scan(const std::string& path);

}  // namespace rattan
