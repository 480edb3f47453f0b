// SPDX-License-Identifier: MIT
#pragma once

// Finds the scans in folders.

#include <functional>
#include <string>
#include <string_view>

#include "jobs/batch/batch_item.h"
#include "jobs/batch/glob.h"

namespace rattan {

/// The parts of a scan's file name: "koala" and "ply.gz" of "koala.ply.gz".
struct ScanName {
  std::string stem;
  std::string extension;  ///< as written; empty if there is none
};
ScanName split_scan_name(std::string_view file_name);

/// Whether the extension is one of .ply .obj .stl .off .drc in any case, also before .gz or .zst.
bool has_scan_extension(std::string_view file_name);
inline constexpr const char* kScanExtensions =
    ".ply, .obj, .stl, .off, .drc, also with .gz or .zst";

struct FoundScan {
  std::string path;      ///< absolute
  std::string relative;  ///< below the folder that was searched, with '/'
  FileStamp stamp;
};

struct WalkOptions {
  PathFilter filter;
  /// A folder not to go into, however it is reached: where outputs go. May not exist.
  std::string skip;
};

/// Hands out all scans in `folder` (absolute) and below, by extension, in the order of their names'
/// bytes. Hidden files and folders are left out. Links are followed, but no folder is visited
/// twice, and one that is also reached without links is found there. A scan that can't be looked at
/// (a link to nothing) has an empty stamp. Throws InputError for a folder that can't be listed.
void walk_scans(const std::string& folder, const WalkOptions& options,
                const std::function<void(FoundScan&&)>& found);

}  // namespace rattan
