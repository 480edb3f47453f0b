// SPDX-License-Identifier: MIT
#pragma once

// The arrangement of the whole scan: its tiles' graphs stitched together and cut until every face
// is a disk, and the way back to each tile. What cells and charts are both made from.

#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/memory_budget.h"
#include "engine/core/store.h"
#include "engine/core/task_graph.h"
#include "engine/layout/arrangement.h"
#include "engine/layout/face_cuts.h"
#include "engine/layout/stitch.h"
#include "engine/layout/tile_arrangement.h"
#include "engine/layout/tile_graph.h"
#include "engine/mesh/tile_mesh.h"
#include "engine/param/triangle_coordinates.h"

namespace rattan::layout {

/// Fixed-point steps per side of a cell.
inline constexpr double kLengthSteps = 1 << 20;

/// One tile, arranged.
struct OpenTile {
  TileMesh mesh;
  std::vector<VertexFrame> frames;
  std::vector<PairValue> phases;
  TileCoordinates coordinates;
  TileArrangement arrangement;
  TracedTile traced;
};

class ScanArrangement {
 public:
  /// Throws UsageError for options out of range. All arguments outlive this.
  ScanArrangement(Store& store, const ScanMesh& mesh, const ArrangementOptions& options,
                  TaskGraph& graph, ArrangementReport& report);

  /// One pass over the tiles; faces may not be disks yet.
  Skeleton stitched();
  struct NotDisks {
    std::uint64_t faces = 0;
    std::uint64_t cuts = 0;  ///< it takes at least so many to make disks of them
    /// Faces with more than `many_sides` strands around, and how many more in all: where lines end
    /// because the surface has features smaller than a face.
    std::uint64_t crowded = 0;
    std::uint64_t excess = 0;
  };
  static NotDisks not_disks(Skeleton& k, std::uint32_t many_sides);
  /// Cuts faces until all are disks; `k` is new then.
  void complete(Skeleton& k);

  /// Runs a pass over some tiles: work(tile, opened, result) wide, done(tile, result) in order.
  template <class Result, class Work, class Done>
  void pass(const char* name, const std::vector<std::uint32_t>& which, const Work& work,
            const Done& done) {
    struct State {
      OpenTile opened;
      Result result;
    };
    run_pass<State>(
        graph_, name, static_cast<std::uint32_t>(which.size()),
        [&](TileId i, State& s) { load(TileId(which[i.value]), s.opened); },
        [&](TileId i, State& s) {
          open(TileId(which[i.value]), s.opened);
          work(which[i.value], s.opened, s.result);
          s.opened = {};
        },
        [&](TileId i, State& s) { done(which[i.value], s.result); });
  }

  std::vector<std::uint32_t> all_tiles() const;
  std::vector<TileGraph>& tiles() { return tiles_; }

 private:
  void load(TileId tile, OpenTile& o);
  void open(TileId tile, OpenTile& o) const;
  void trace_tiles(const std::vector<std::uint32_t>& which, bool count);
  bool cut(Skeleton& k);

  Store& store_;
  const ScanMesh& mesh_;
  ArrangementOptions options_;
  TaskGraph& graph_;
  ArrangementReport& report_;
  TraceOptions trace_;
  Reservation reserved_;
  std::uint64_t graph_bytes_ = 0;
  std::vector<TileGraph> tiles_;
  std::vector<PointKey> cuts_;                    // of the whole scan, sorted
  std::vector<std::vector<PointKey>> tile_cuts_;  // those each tile must know, sorted
};

}  // namespace rattan::layout
