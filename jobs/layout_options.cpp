// SPDX-License-Identifier: MIT
#include "jobs/layout_options.h"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include <fmt/format.h>

#include "engine/core/errors.h"

namespace rattan {

std::string LayoutOptions::canonical() const {
  return fmt::format(
      "chart-size={} symmetry={} smoothing={} curl-correction={} energy={} solver={} "
      "newton-steps={} relax={} atlas={} bake={} position-bits={} tile-size={} merge-vertices={} "
      "drop-components={} fill-holes={}",
      chart_size, symmetry, smoothing ? fmt::format("{}", *smoothing) : std::string("auto"),
      curl_correction ? 1 : 0, energy == Energy::kEdge ? "edge" : "triangle",
      solver == SolverKind::kNested ? "nested" : "reference", newton_steps, relax,
      atlas || bake > 0 ? 1 : 0, bake, position_bits, tile_size, merge_vertices ? 1 : 0,
      drop_components, fill_holes);
}

LayoutNames layout_names(const std::string& output) {
  const std::filesystem::path path(output);
  const std::string stem = (path.parent_path() / path.stem()).string();
  return {.base = stem + ".base" + path.extension().string(),
          .charts = stem + ".charts.json",
          .image = stem + ".png",
          .material = stem + ".mtl"};
}

std::vector<std::string> layout_files(const LayoutOptions& options) {
  const LayoutNames names = layout_names(options.output);
  std::vector<std::string> files{options.output, names.base, names.charts};
  if (options.bake > 0) {
    files.push_back(names.image);
    if (std::filesystem::path(options.output).extension() == ".obj") {
      files.push_back(names.material);
    }
  }
  for (const std::string& more : {options.report, options.preview}) {
    if (!more.empty()) {
      files.push_back(more);
    }
  }
  return files;
}

void check_layout_files(const LayoutOptions& options, std::span<const std::string> inputs) {
  namespace fs = std::filesystem;
  const std::vector<std::string> files = layout_files(options);
  std::vector<std::string> sorted;
  for (const std::string& file : files) {
    std::error_code error;
    for (const std::string& input : inputs) {
      if (fs::equivalent(file, input, error)) {
        throw UsageError(file +
                         (input == options.scan
                              ? ": the layout would replace the scan itself."
                              : ": the layout would replace a file that the scan needs.") +
                         " Give it another name.");
      }
    }
    sorted.push_back(fs::path(file).lexically_normal().string());
  }
  std::sort(sorted.begin(), sorted.end());
  const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
  if (twice != sorted.end()) {
    throw UsageError(*twice +
                     ": two files of this name would be written. Give one of them another.");
  }
}

}  // namespace rattan
