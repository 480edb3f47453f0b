// SPDX-License-Identifier: MIT
#pragma once

// Everything `rattan layout` can be asked for.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "jobs/scan_options.h"

namespace rattan {

struct LayoutOptions : ScanOptions {
  LayoutOptions() { newton_steps = 2; }

  /// Side of a chart, in file units; 0: ten times the mean edge of the repaired scan.
  double chart_size = 0.0;
  /// Rounds of relaxation across chart borders.
  int relax = 0;
  /// Texture coordinates in one unit square for all charts.
  bool atlas = false;
  /// Side of an image of the atlas in texels, with the scan's colours; 0: none. Means an atlas.
  std::uint32_t bake = 0;

  /// The options that decide the bytes of the output, as one line of text.
  std::string canonical() const;
};

/// What is written beside the output "x/bust.obj".
struct LayoutNames {
  std::string base;      ///< the base complex: x/bust.base.obj
  std::string charts;    ///< parts and transition functions: x/bust.charts.json
  std::string image;     ///< the baked atlas: x/bust.png
  std::string material;  ///< beside an .obj, with an image: x/bust.mtl
};
LayoutNames layout_names(const std::string& output);

/// All files that a run writes: of those above what is asked for, report and preview included.
std::vector<std::string> layout_files(const LayoutOptions& options);
/// Throws UsageError if one of them is one of `inputs`, or two are the same file.
void check_layout_files(const LayoutOptions& options, std::span<const std::string> inputs);

}  // namespace rattan
