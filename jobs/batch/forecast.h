// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "jobs/batch/batch_item.h"

namespace rattan {

/// What a scan will take, told without reading it.
struct Forecast {
  double triangles = 0.0;
  bool counted = false;      ///< the triangles, by the file's header
  double faces = 0.0;        ///< of the largest remesh; 0: the area decides
  double cpu_seconds = 0.0;  ///< on one thread
  std::uint64_t least_memory = 0;
  std::uint64_t good_memory = 0;  ///< bytes with which nothing is written out and read again
};

/// From counts in the file's header where the format has them, else from the file's size. Some tens
/// of microseconds, on a missing or damaged file too, and never throws for one.
Forecast forecast(const BatchItem& item);

/// Wall seconds on so many threads.
double forecast_seconds(const Forecast& forecast, int threads);

}  // namespace rattan
