// SPDX-License-Identifier: MIT
#pragma once

// Distances between scan and remesh, both ways.

#include <cstdint>

#include "engine/core/store.h"
#include "engine/core/task_graph.h"
#include "engine/mesh/tile_mesh.h"
#include "engine/remesh/polygon_mesh.h"
#include "engine/remesh/surface_projector.h"

namespace rattan {

struct DistanceOptions {
  /// Measure every k-th vertex of the scan, by global number; 1 measures all.
  std::uint32_t scan_stride = 1;
  /// Points spread evenly over each of the two surfaces, by area; 0 for none. Both surfaces then
  /// come out the same however their vertices lie.
  std::uint64_t samples = 0;
};

/// Distances from one surface to the other, in units of the file. Maxima are over all points
/// measured; the other figures over the samples spread by area, or over the vertices where there
/// are none.
struct OneWayDistances {
  double mean = 0.0;
  double rms = 0.0;
  double p99 = 0.0;  ///< 99th percentile, to a relative 1/1024
  double max = 0.0;
  std::uint64_t points = 0;   ///< that the maximum is over
  std::uint64_t samples = 0;  ///< that the other figures are over
};

struct DistanceReport {
  OneWayDistances to_input;    ///< from the remesh: its vertices, the middles of its faces, samples
  OneWayDistances from_input;  ///< from the scan: its vertices, samples
  double diagonal = 0.0;       ///< of the scan's box
  double scan_share = 0.0;     ///< share of the scan's vertices measured
};

/// f(LocalTriangle) for each triangle that a face counts as, in vertices of the mesh: of a quad
/// those of its shorter diagonal, of a larger face a fan.
template <class F>
void for_face_triangles(const PolygonMesh& mesh, std::size_t face, const F& f) {
  const auto c = mesh.face(face);
  if (c.size() == 4 && (mesh.positions[c[1]] - mesh.positions[c[3]]).squaredNorm() <
                           (mesh.positions[c[0]] - mesh.positions[c[2]]).squaredNorm()) {
    f(LocalTriangle{c[1], c[2], c[3]});
    f(LocalTriangle{c[1], c[3], c[0]});
    return;
  }
  for (std::size_t k = 1; k + 1 < c.size(); ++k) {
    f(LocalTriangle{c[0], c[k], c[k + 1]});
  }
}

/// Exact distances of the points, with faces as for_face_triangles has them. Passes over the tiles:
/// one, and those of one projection. Memory: about 60 bytes a face of the remesh, 130 a sample, and
/// what the projector keeps alive.
DistanceReport measure_distances(const PolygonMesh& remesh, Store& store, const ScanMesh& scan,
                                 SurfaceProjector& projector, const DistanceOptions& options,
                                 TaskGraph& graph);

}  // namespace rattan
