// SPDX-License-Identifier: MIT
#pragma once

// Where each scan's remesh goes, by a pattern, and that no two meet there.

#include <span>
#include <string>
#include <string_view>

#include "jobs/batch/batch_item.h"

namespace rattan {

/// What is known of a scan's place.
struct ScanPlace {
  std::string root;       ///< name of the folder that was searched, or that the scan lies in
  std::string folder;     ///< of the scan, below the root; may be empty
  std::string file_name;  ///< of the scan
};

/// "{dir}/{stem}.drc": {dir} the folder below the one that was searched, {stem} the scan's name
/// without extension, {ext} its extension ("ply", "ply.gz"), {root} the name of the folder that was
/// searched. {faces}, {size} and {n} stay, for what expand_names() makes of them.
class OutputTemplate {
 public:
  /// Throws UsageError for braces that mean nothing.
  explicit OutputTemplate(std::string text);
  std::string operator()(const ScanPlace& place) const;
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

/// The path below the batch's folder in its shortest form. Throws UsageError that begins with
/// `place` for one that leads out of it or into the folders that the batch keeps there, or whose
/// extension is no format.
std::string checked_output(std::string_view output, const std::string& place);

/// Throws UsageError that names both scans and the remedy if two outputs of the items are the same
/// file, one is needed as a folder by another, or one would replace a scan of the batch. `items` in
/// any order; `directory`: of the batch, empty for none yet.
void check_outputs(std::span<const BatchItem> items, const std::string& directory);

}  // namespace rattan
