// SPDX-License-Identifier: MIT
#pragma once

// What became of a batch, for people and for programs: DIR/report.html and DIR/report.json, from
// the journal and from what `rattan remesh --report` left for each scan.

#include <span>
#include <string>

#include "jobs/batch/batch_item.h"
#include "jobs/report_page/batch_report.h"

namespace rattan {

/// Writes both files, each complete or not at all; may be called at any time, also while other
/// processes work on the batch. `items`, if given, is what the batch is about: those of which the
/// journal says nothing are listed as pending. Throws InputError where no batch has ever run,
/// ResourceError when the files cannot be written. Memory: about 1 KiB a scan.
ReportTotals write_batch_report(const std::string& directory,
                                std::span<const BatchItem> items = {});

}  // namespace rattan
