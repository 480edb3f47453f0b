// SPDX-License-Identifier: MIT
#include "jobs/repair_warnings.h"

#include <fmt/format.h>

namespace rattan {

void warn_of_repairs(const std::string& scan, const RepairCounts& repaired,
                     ProgressSink& progress) {
  if (repaired.triangle_soup > 0) {
    progress.warning(
        fmt::format("{}: its triangles share no vertices; {} vertices at positions equal to "
                    "another's were merged.",
                    scan, repaired.merged_vertices));
  }
  if (repaired.non_finite_vertices > 0) {
    progress.warning(
        fmt::format("{}: {} vertices without finite coordinates were dropped, and the {} "
                    "triangles at them.",
                    scan, repaired.non_finite_vertices, repaired.non_finite_triangles));
  }
  if (repaired.one_sided_components > 0) {
    progress.warning(
        fmt::format("{}: {} components have one side only, like a Moebius strip; they were cut "
                    "open where their triangles turn over.",
                    scan, repaired.one_sided_components));
  }
  if (repaired.non_manifold_edges + repaired.split_vertices > 0) {
    progress.warning(fmt::format(
        "{}: {} non-manifold edges were cut open and {} vertices split; see input.repaired in "
        "the report.",
        scan, repaired.non_manifold_edges, repaired.split_vertices));
  }
}

}  // namespace rattan
