// SPDX-License-Identifier: MIT
#pragma once

// Which scans a batch has and what is asked for each: the part of the command line that `batch` and
// `slurm` share.

#include <functional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "jobs/batch/batch_item.h"
#include "tools/rattan/remesh_arguments.h"

namespace rattan {

struct BatchSelection {
  std::vector<std::string> paths;  ///< scans, folders, manifests (.csv, .jsonl)
  std::string directory;           ///< of the outputs
  std::vector<std::string> include;
  std::vector<std::string> exclude;
  std::string name;    ///< template; empty: {dir}/{stem}.FORMAT
  std::string format;  ///< drc, obj, ply or off; empty: drc
  RemeshArguments remesh;
};

/// PATHS, -o, --include, --exclude, --name, --format and the options of add_scan_options().
/// Neither PATHS nor -o is marked as required: select_items() asks for PATHS.
void add_selection_options(CLI::App& app, BatchSelection& selection);

/// The items, by id. Reads folders, manifests and the stamps of files, writes nothing. `warn` gets
/// sentences for the user. Throws UsageError for whatever must be put right before anything runs:
/// no scans, two scans with one output, an output that would replace a scan, bad rows.
std::vector<BatchItem> select_items(const BatchSelection& selection,
                                    const std::function<void(const std::string&)>& warn);

}  // namespace rattan
