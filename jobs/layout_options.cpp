// SPDX-License-Identifier: MIT
#include "jobs/layout_options.h"

#include <filesystem>

#include <fmt/format.h>

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

}  // namespace rattan
