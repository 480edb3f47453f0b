// SPDX-License-Identifier: MIT
#pragma once

// Where the remeshes of one run go.

#include <span>
#include <string>
#include <vector>

#include "jobs/remesh_options.h"

namespace rattan {

/// One path a size: `path` as it is for one size. For several, {n} stands for the place in the list
/// (from 1), {size} for the size as asked for, {faces} for the same where the sizes are numbers of
/// faces; a path without any of these gets "-<size>" before its extension. Throws UsageError if two
/// paths are the same, or for {faces} where it isn't known beforehand.
std::vector<std::string> expand_names(const std::string& path, SizeKind kind,
                                      std::span<const double> sizes);

/// The paths of options.output, checked: a format by the extension, a folder that exists, not the
/// scan itself. Throws UsageError.
std::vector<std::string> output_names(const RemeshOptions& options);

}  // namespace rattan
