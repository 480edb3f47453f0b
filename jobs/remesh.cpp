// SPDX-License-Identifier: MIT
#include "jobs/remesh.h"

#include <cmath>
#include <utility>

#include <nlohmann/json.hpp>

#include "jobs/remesh_job.h"
#include "jobs/version.h"

namespace rattan {

namespace {

void demand(bool condition, const char* sentence) {
  if (!condition) {
    throw UsageError(sentence);
  }
}

// What the command line checks as it reads.
void check(const RemeshOptions& o) {
  demand(!o.scan.empty(), "No scan is named.");
  demand(!o.output.empty(), "No output is named.");
  demand(!o.sizes.empty(), "No size is asked for.");
  for (const double size : o.sizes) {
    demand(std::isfinite(size) && size > 0.0, "A size has to be a positive number.");
  }
  demand(o.density >= 0 && o.density <= 16,
         "The density goes from 1 to 16; 0 leaves it to Rattan.");
  demand(o.symmetry == 1 || o.symmetry == 2 || o.symmetry == 4, "The symmetry is 1, 2 or 4.");
  demand(!o.smoothing || (*o.smoothing > 0.0 && *o.smoothing < 1.0),
         "The smoothing lies between 0 and 1.");
  demand(o.crease == 0.0 || (o.crease >= 5.0 && o.crease <= 179.0),
         "Creases turn by 5 to 179 degrees; 0 keeps none.");
  demand(o.newton_steps >= 0 && o.newton_steps <= 1000, "There are 0 to 1000 Newton steps.");
  demand(o.position_bits >= 0 && o.position_bits <= 30,
         "A coordinate has 1 to 30 bits; 0 leaves them to Rattan.");
  demand(o.tile_size > 0, "A tile has at least one vertex.");
  demand(o.threads >= 0 && o.threads <= 4096, "There are 1 to 4096 threads; 0 takes them all.");
}

}  // namespace

RemeshResult remesh(const RemeshOptions& options, ProgressSink& progress,
                    const StopRequests& stop) {
  check(options);
  RemeshReport report = remesh_scan(options, progress, stop);
  RemeshResult result;
  for (const RemeshReport::Finished& finished : report.outputs) {
    const auto& o = finished.output;
    result.outputs.push_back({.path = o.path,
                              .bytes = o.bytes,
                              .vertices = o.vertices,
                              .faces = o.faces,
                              .quads = o.quads,
                              .triangles = o.triangles,
                              .irregular_vertices = o.irregular_vertices,
                              .target_met = o.target_met,
                              .distance_rms = finished.distance.from_input.rms});
  }
  result.seconds = report.seconds;
  result.peak_rss_bytes = report.peak_rss_bytes;
  result.report = to_json(report).dump(2) + '\n';
  result.warnings = std::move(report.warnings);
  return result;
}

const char* library_version() {
  return version();
}

}  // namespace rattan
