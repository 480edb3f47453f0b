// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "jobs/batch/batch_item.h"
#include "jobs/batch/batch_run.h"
#include "jobs/batch/journal.h"

namespace rattan {

/// Where everything of one item lies.
struct ItemFiles {
  ItemFiles(const BatchItem& item, const BatchRunOptions& options);

  std::string output;  ///< for several sizes a template
  std::string work;    ///< the work directory of `rattan remesh`
  std::string log;     ///< only after a failure
  std::string report_folder;
  std::string report;

  /// Folders that a child expects to be there. Throws ResourceError.
  void make_folders() const;
};

/// The words of the child that makes an item: program, "remesh", scan and all options.
std::vector<std::string> child_command(const BatchItem& item, const BatchRunOptions& options,
                                       int threads, std::uint64_t memory, bool fresh);

/// Outputs as they are on disk; those that aren't there are left out.
std::vector<OutputFile> written_outputs(const BatchItem& item, const BatchRunOptions& options);

/// What the report of a run says that ended with nobody watching.
struct FoundReport {
  double seconds = 0.0;
  std::uint64_t peak_rss_bytes = 0;
  std::uint64_t warnings = 0;
};
/// True if the report that a run writes last is there, is of this scan, and the outputs that it
/// tells of are as it says: then the run did all that it had to do.
bool finished_unseen(const BatchItem& item, const BatchRunOptions& options, FoundReport& found);

/// Replaces the file. A log that can't be written is no reason to stop: false then.
bool write_text(const std::string& path, const std::string& text);

}  // namespace rattan
