// SPDX-License-Identifier: MIT
#pragma once

// Makes scans of any size: closed surfaces of any genus, or with holes, that have what real scans
// have: relief over several octaves, creases, uneven density, irregular valences, noise, and an
// order of triangles that jumps about. Reproducible bit for bit on any machine, and streaming.

#include <cstdint>
#include <string>

#include "engine/core/progress.h"

namespace rattan {

struct SynthOptions {
  /// Met exactly where parity allows for small scans, within 1 % always; 12 to 8e9 for genus 0,
  /// more from the start for higher genus.
  std::uint64_t triangles = 100000;
  std::uint64_t seed = 1;
  int genus = 0;
  /// Half-width of the measuring noise along the normal, in local edge lengths.
  double noise = 0.1;
  /// Boundary loops: disjoint disks with ragged edges are missing. 0 gives a closed surface.
  int holes = 0;
};

struct SynthResult {
  std::uint64_t vertices = 0;
  std::uint64_t triangles = 0;
};

/// Writes a binary little-endian PLY: one connected oriented manifold of the genus, about 250 units
/// across. The file appears at `path` when it is complete. Memory is O(sqrt(triangles)), 30 MiB for
/// 1e9. Throws UsageError for impossible options and ResourceError if the disk fills up.
SynthResult synthesise(const SynthOptions& options, const std::string& path,
                       ProgressSink& progress);

}  // namespace rattan
