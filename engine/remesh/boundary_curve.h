// SPDX-License-Identifier: MIT
#pragma once

// The boundary of the scan as polylines, for boundary vertices to slide along.

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engine/core/store.h"
#include "engine/core/task_graph.h"
#include "engine/mesh/tile_mesh.h"
#include "engine/remesh/triangle_index.h"

namespace rattan {

/// Holds all boundary edges in memory (about 60 bytes an edge), not the scan.
class BoundaryCurve {
 public:
  struct Point {
    Vec3d point = Vec3d::Zero();
    std::uint32_t loop = 0;
    bool found = false;
  };

  /// One pass over the tiles; only those with boundary vertices are read beyond their flags.
  BoundaryCurve(Store& store, const ScanMesh& mesh, TaskGraph& graph);

  bool empty() const { return segments_.empty(); }
  std::size_t segment_count() const { return segments_.size(); }
  std::uint32_t loop_count() const { return loops_; }
  /// The corners of each loop in order, the surface on their left. Built from what is held anyway.
  std::vector<std::vector<Vec3d>> loops() const;
  /// Closest point of all loops; ties go to the lowest segment.
  Point closest(const Vec3d& p) const;
  /// Closest point of one loop.
  Point closest_on_loop(const Vec3d& p, std::uint32_t loop) const;

 private:
  Point result(const Vec3d& p, const ClosestHit& hit) const;

  std::vector<Vec3f> ends_;              ///< two a segment
  std::vector<LocalTriangle> segments_;  ///< as triangles without area
  std::vector<std::uint32_t> loop_;      ///< one a segment
  /// One a segment: its ends as numbers of boundary vertices, the surface on the left.
  std::vector<std::array<std::uint32_t, 2>> path_;
  std::vector<std::uint8_t> reversed_;  ///< one a segment: its path runs from the second end
  std::uint32_t loops_ = 0;
  std::unique_ptr<TriangleIndex> index_;
};

}  // namespace rattan
