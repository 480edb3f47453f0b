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
  std::uint64_t picture = 0;  ///< samples of the preview

  std::uint64_t total() const { return process + tiles + scan + output + picture; }
};

/// Tiles that may be in flight at once: two a thread and two more, within a quarter of the budget.
int tiles_in_flight(std::uint64_t budget, int threads);

/// What is asked of a run, as far as it counts here; 0 for what isn't known yet.
struct MemoryWish {
  std::uint64_t vertices = 0;  ///< of the scan
  double faces = 0.0;          ///< of the largest remesh
  int threads = 1;
  bool picture = false;  ///< a preview
  double charts = 0.0;   ///< of a layout
};

MemoryNeed memory_need(const MemoryWish& wish, std::uint64_t budget);

/// Of MemoryNeed::output: what is to be free when lines become a mesh of so many faces.
std::uint64_t output_bytes(double faces);

/// The smallest budget with which a run can be made; in whole MiB.
std::uint64_t least_budget(const MemoryWish& wish);

/// Throws ResourceError that says how much is needed and for what.
void check_memory(const MemoryWish& wish, std::uint64_t budget, const std::string& scan);

/// Bytes of a ray tracer's index of one triangle.
inline constexpr std::uint64_t kPictureBytesPerTriangle = 250;

}  // namespace rattan
