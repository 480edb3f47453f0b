// SPDX-License-Identifier: MIT
#include "jobs/remesh_options.h"

#include <fmt/format.h>

namespace rattan {

RemeshOptions RemeshOptions::resolved() const {
  RemeshOptions o = *this;
  if (o.density == 0) {
    o.density = o.pure_quads ? 4 : 1;
  }
  return o;
}

std::string RemeshOptions::canonical(double size) const {
  const char* size_names[] = {"faces", "edge-length", "ratio"};
  std::string text = fmt::format(
      "{}={} density={} symmetry={} smoothing={} curl-correction={} energy={} solver={} "
      "newton-steps={} pure-quads={} position-bits={} tile-size={} merge-vertices={} "
      "drop-components={} fill-holes={} crease={}",
      size_names[static_cast<int>(size_kind)], size, density, symmetry,
      smoothing ? fmt::format("{}", *smoothing) : std::string("auto"), curl_correction ? 1 : 0,
      energy == Energy::kEdge ? "edge" : "triangle",
      solver == SolverKind::kNested ? "nested" : "reference", newton_steps, pure_quads ? 1 : 0,
      position_bits, tile_size, merge_vertices ? 1 : 0, drop_components, fill_holes,
      crease > 0.0 ? fmt::format("{}", crease) : std::string("off"));
  return text;
}

}  // namespace rattan
