// SPDX-License-Identifier: MIT
#include "jobs/remesh_options.h"

#include <fmt/format.h>

namespace rattan {

std::string RemeshOptions::canonical() const {
  const char* size_names[] = {"faces", "edge-length", "ratio"};
  std::string text = fmt::format(
      "{}={} density={} symmetry={} smoothing={} curl-correction={} energy={} solver={} "
      "newton-steps={} position-bits={} tile-size={} crease={}",
      size_names[static_cast<int>(size_kind)], size, density, symmetry,
      smoothing ? fmt::format("{}", *smoothing) : std::string("auto"), curl_correction ? 1 : 0,
      energy == Energy::kEdge ? "edge" : "triangle",
      solver == SolverKind::kNested ? "nested" : "reference", newton_steps, position_bits,
      tile_size, crease > 0.0 ? fmt::format("{}", crease) : std::string("off"));
  return text;
}

}  // namespace rattan
