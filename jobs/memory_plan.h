// SPDX-License-Identifier: MIT
#pragma once

// What a run needs at least in memory, whatever the cache: so that a budget too small is refused
// before the work, not after it.

#include <cstdint>
#include <string>

namespace rattan {

/// Bytes; measured with caches at their smallest (see jobs/README.md), rounded up.
struct MemoryNeed {
  std::uint64_t process = 0;  ///< libraries, the smallest cache, sort buffers
  std::uint64_t tiles = 0;    ///< tiles in flight
  std::uint64_t scan = 0;     ///< tables of tiles, values on the rims of tiles
  std::uint64_t output = 0;   ///< the arrangement, the remesh, the encoder

  std::uint64_t total() const { return process + tiles + scan + output; }
};

/// Tiles that may be in flight at once: two a thread and two more, within a quarter of the budget.
int tiles_in_flight(std::uint64_t budget, int threads);

/// `vertices` of the scan, `faces` of the largest remesh; 0 for what isn't known yet.
MemoryNeed memory_need(std::uint64_t vertices, double faces, std::uint64_t budget, int threads);

/// Of MemoryNeed::output: what is to be free when lines become a mesh of so many faces.
std::uint64_t output_bytes(double faces);

/// Throws ResourceError that says how much is needed and for what.
void check_memory(const MemoryNeed& need, std::uint64_t budget, const std::string& scan,
                  double faces);

}  // namespace rattan
