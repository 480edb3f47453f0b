// SPDX-License-Identifier: MIT
#pragma once

// Closest points on the scan, tile by tile: the one way from the remesh back to the input surface.

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "engine/core/memory_budget.h"
#include "engine/core/store.h"
#include "engine/core/task_graph.h"
#include "engine/mesh/tile_mesh.h"
#include "engine/remesh/triangle_index.h"

namespace rattan {

struct ProjectorOptions {
  /// Tiles whose triangles and hierarchy stay in memory between calls (about 50 bytes a triangle);
  /// the others are rebuilt whenever they are needed. Changes no result.
  std::uint32_t tiles_alive = std::numeric_limits<std::uint32_t>::max();
  /// Ledger for them, which leaves half of what is free to others; may be null, else outlives the
  /// projector.
  MemoryBudget* budget = nullptr;
};

struct ProjectionQuery {
  Vec3d point = Vec3d::Zero();
  /// Nothing farther than this counts; scan units.
  double radius = std::numeric_limits<double>::infinity();
  /// A triangle of the scan believed to be near, or kNoTriangle. Saves time, changes no result.
  std::uint64_t hint = kNoTriangle;
};

struct SurfacePoint {
  Vec3d point = Vec3d::Zero();           ///< closest point of the scan
  Vec3d normal = Vec3d::Zero();          ///< of the triangle, unit; zero if it has no area
  std::array<double, 3> weights{};       ///< of the triangle's corners as stored in its owner tile
  std::uint64_t triangle = kNoTriangle;  ///< kNoTriangle: none within the radius
  double distance2 = std::numeric_limits<double>::infinity();

  bool found() const { return triangle != kNoTriangle; }
};

/// Among equally near triangles the lowest id wins, so that results depend neither on the tile
/// size, nor on what is kept alive, nor on threads, nor on the processor.
class SurfaceProjector {
 public:
  /// One pass over the tiles for their boxes. `store` and `mesh` must outlive the projector.
  SurfaceProjector(Store& store, const ScanMesh& mesh, const ProjectorOptions& options,
                   TaskGraph& graph);
  ~SurfaceProjector();
  SurfaceProjector(const SurfaceProjector&) = delete;
  SurfaceProjector& operator=(const SurfaceProjector&) = delete;

  /// results[i] answers queries[i]. At most two passes over those tiles that lie within reach.
  void project(std::span<const ProjectionQuery> queries, std::span<SurfacePoint> results,
               TaskGraph& graph);

  /// Queries answered so far.
  std::uint64_t queries() const { return queries_; }

 private:
  struct TileScene;
  struct Box {
    Vec3f lo;
    Vec3f hi;
  };
  /// Queries by tile: those of tile t are query[begin[t] .. begin[t + 1]), ascending.
  struct Bins {
    std::vector<std::uint64_t> begin;
    std::vector<std::uint32_t> query;
  };

  std::shared_ptr<const TileScene> scene(TileId tile);
  void keep(TileId tile, std::shared_ptr<const TileScene> scene);
  TileId nearest_box(const Vec3d& p) const;
  template <class F>
  void for_boxes_within(const Vec3d& p, double distance2, const F& f) const;
  void run(const char* name, const Bins& bins, std::span<const ProjectionQuery> queries,
           std::span<SurfacePoint> results, TaskGraph& graph);

  Store& store_;
  const ScanMesh& mesh_;
  ProjectorOptions options_;
  std::vector<Box> boxes_;        ///< of each tile's owned triangles
  std::vector<Box> group_boxes_;  ///< of kGroup consecutive tiles
  std::vector<std::shared_ptr<const TileScene>> alive_;
  std::uint32_t alive_count_ = 0;
  std::uint64_t most_alive_bytes_ = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t alive_bytes_ = 0;
  Reservation reserved_;
  std::uint64_t queries_ = 0;
};

}  // namespace rattan
