// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "jobs/remesh_options.h"

namespace rattan {

/// What is asked of a scan. Scans with the same options share one of these: a batch may have
/// hundreds of thousands of them.
struct ItemOptions {
  /// Words for `rattan remesh`, without scan and output; those left at their default omitted, in a
  /// fixed order.
  std::vector<std::string> words;
  /// What decides the output's bytes besides the scan, as text.
  std::string key;
  /// Parsed from `words`; scan and output are empty.
  RemeshOptions remesh;
};

/// One scan of a batch.
struct BatchItem {
  std::string id;    ///< output path below the batch's directory; for several sizes a template
  std::string scan;  ///< absolute path
  std::shared_ptr<const ItemOptions> what;  ///< never null
  std::uint64_t scan_bytes = 0;             ///< size of the file
  std::int64_t scan_time = 0;               ///< its modification, ns since 1970
  double cost = 0.0;                        ///< cpu seconds as a manifest says; 0: to be foreseen
};

}  // namespace rattan
