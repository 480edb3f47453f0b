// SPDX-License-Identifier: MIT
#pragma once

// `rattan batch --dry-run`: what a batch would take.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "jobs/batch/batch_item.h"
#include "jobs/batch/batch_run.h"

namespace rattan {

struct BatchTable {
  std::string text;  ///< a line for each scan and the totals
  bool fits = true;  ///< no scan to be done needs more memory than the batch has
};

/// `budget` and `threads`: of the whole batch.
BatchTable batch_table(std::span<const BatchItem> items, std::span<const Standing> standings,
                       std::uint64_t budget, int threads);

/// Processor seconds: as stated in a manifest, else predicted.
double item_cost(const BatchItem& item);

}  // namespace rattan
