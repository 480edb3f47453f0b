// SPDX-License-Identifier: MIT
#pragma once

// Lists of scans with options of their own, as CSV or JSON lines.

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "jobs/batch/batch_item.h"

namespace rattan {

/// Whether the name's extension says manifest: .csv or .jsonl, in any case.
bool is_manifest_name(std::string_view path);

struct ManifestRow {
  std::string path;    ///< as written
  std::string output;  ///< below the batch's folder; empty: by the template
  double cost = 0.0;   ///< processor seconds; 0: not stated
  /// Options of `remesh`, by name without dashes, and their values as text. Without empty ones.
  std::vector<std::pair<std::string, std::string>> options;
  std::string place;  ///< "scans.csv: line 7"
};

/// Hands out the rows one by one. `columns`: the names of options that a row may give, besides
/// path, output and cost. Throws UsageError that names file, line, what is wrong and the remedy:
/// for what isn't CSV or JSON, for columns that don't exist (with the nearest that does) or stand
/// there twice, for a row without path or with a cost that is no number. Throws InputError for a
/// file that can't be read. Values of options are not looked at.
void read_manifest(const std::string& file, const std::vector<std::string>& columns,
                   const std::function<void(ManifestRow&&)>& row);

/// Writes the items with everything resolved: absolute path, output, cost and options. `costs` is
/// empty (those of the items, if stated) or has one for each item. Reading it gives the same items.
/// The format is told by the name. Throws InputError or ResourceError if it can't be written.
void write_manifest(const std::string& file, std::span<const BatchItem> items,
                    std::span<const double> costs);

/// Of `words`, the one that is spelled most like `word`; empty if none is near.
std::string nearest_word(std::string_view word, std::span<const std::string> words);

}  // namespace rattan
