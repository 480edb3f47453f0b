// SPDX-License-Identifier: MIT
#include "jobs/batch/forecast.h"

#include <algorithm>

#include "io/scan/scan_outline.h"
#include "jobs/memory_plan.h"
#include "jobs/remesh_cost.h"
#include "jobs/target_size.h"

namespace rattan {

namespace {

// What decoding a Draco file takes, see guarded_draco.cpp; half of the budget may go there.
constexpr double kDracoBytesPerTriangle = 140.0;
constexpr double kDracoBytesPerVertex = 80.0;
/// Faces of a remesh whose quads' side is given, for each triangle: as of the default ratio.
constexpr double kFacesByArea = 0.05;

}  // namespace

Forecast forecast(const BatchItem& item) {
  const RemeshOptions options = item.what->remesh.resolved();
  const ScanOutline scan = outline_scan(item.scan);
  Forecast f;
  f.triangles = scan.triangles;
  f.counted = scan.counted;
  f.faces = asked_faces(options, static_cast<std::uint64_t>(scan.triangles));
  const double faces = f.faces > 0.0 ? f.faces : kFacesByArea * scan.triangles;
  f.cpu_seconds = item.cost > 0.0 ? item.cost
                                  : remesh_cpu_seconds(scan.triangles, faces,
                                                       static_cast<double>(options.sizes.size()));
  const auto vertices = static_cast<std::uint64_t>(scan.vertices);
  f.least_memory =
      least_budget({.vertices = vertices, .faces = faces, .picture = !options.preview.empty()});
  if (scan.whole) {
    const auto decoded = static_cast<std::uint64_t>(kDracoBytesPerTriangle * scan.triangles +
                                                    kDracoBytesPerVertex * scan.vertices);
    f.least_memory = std::max(f.least_memory, 2 * (scan.bytes + decoded));
  }
  f.good_memory = f.least_memory + kLiveBytesPerVertex * vertices;
  return f;
}

double forecast_seconds(const Forecast& forecast, int threads) {
  return remesh_wall_seconds(forecast.cpu_seconds, threads);
}

}  // namespace rattan
