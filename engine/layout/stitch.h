// SPDX-License-Identifier: MIT
#pragma once

// The tiles' graphs joined into the graph of the whole scan, in memory: dangling paths peeled off,
// contractible circles dropped, paths dissolved into arcs between essential nodes, and the Euler
// characteristic of every face.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/layout/disjoint_sets.h"
#include "engine/layout/graph_keys.h"
#include "engine/layout/tile_graph.h"

namespace rattan::layout {

struct SkeletonArc {
  std::array<std::uint32_t, 2> node{kNone, kNone};
  std::uint32_t left = 0;      ///< stitched face; compare through faces.find
  std::uint32_t right = 0;     ///< kNone beyond the boundary
  std::uint32_t tile = kNone;  ///< kNone: a piece of a rim edge
  std::uint32_t index = 0;     ///< arc of the tile's graph
  std::uint64_t triangle = 0;  ///< of a rim piece
  std::int64_t length = 0;
  PointKey piece;  ///< of a rim piece
  bool cut = false;
  bool feature = false;
  bool alive = true;
};

/// A chain of arcs between essential nodes, or closed without any.
struct Strand {
  std::uint32_t first = 0;  ///< dart; dart 2 a runs along arc a from node[0] to node[1]
  std::uint32_t last = 0;
  std::int64_t length = 0;
  bool closed = false;
  bool boundary = false;  ///< its darts have the scan on their left
  bool cut = false;
  bool feature = false;
};

struct StitchCounts {
  std::uint64_t dangling_ends = 0;
  std::uint64_t dropped_circles = 0;
};

struct Skeleton {
  std::vector<std::uint32_t> face_base;  ///< tiles + 1
  std::vector<std::uint32_t> arc_base;   ///< tiles + 1; rim pieces follow
  DisjointSets faces{0};
  std::vector<std::int64_t> euler;      ///< valid at roots
  std::vector<std::uint8_t> singular;   ///< valid at roots
  std::vector<std::uint8_t> has_graph;  ///< valid at roots: some arc bounds it
  std::vector<GraphNode> nodes;
  std::vector<SkeletonArc> arcs;
  std::vector<std::uint32_t> dart_begin;  ///< nodes + 1
  std::vector<std::uint32_t> darts;       ///< alive ones leaving each node, counter-clockwise
  std::vector<std::uint32_t> dart_place;  ///< where in `darts` a dart is listed; kNone if dead
  std::vector<std::uint32_t> essential;   ///< nodes that stay, ascending by key
  std::vector<std::uint8_t> is_essential;
  std::vector<Strand> strands;  ///< open ones first, in canonical order
  StitchCounts counts;

  std::uint32_t degree(std::uint32_t node) const { return dart_begin[node + 1] - dart_begin[node]; }
  std::uint32_t start(std::uint32_t dart) const { return arcs[dart >> 1].node[dart & 1U]; }
  std::uint32_t end(std::uint32_t dart) const { return start(dart ^ 1U); }
  /// Stitched face on the left; kNone beyond the boundary.
  std::uint32_t left(std::uint32_t dart) {
    const SkeletonArc& a = arcs[dart >> 1];
    const std::uint32_t f = (dart & 1U) == 0 ? a.left : a.right;
    return f == kNone ? kNone : faces.find(f);
  }
  /// Along the strand; kNone at an essential node.
  std::uint32_t next_on_strand(std::uint32_t dart) const;
  /// Around the face on the left.
  std::uint32_t next_around(std::uint32_t dart) const;
};

/// `cuts`: all cut pieces of the scan, sorted. Of the boundary vertices that turn sharply, those
/// stay corners where the boundary turns as sharply between half a side before and half a side
/// behind, one within that distance. Deterministic and independent of how the scan is divided into
/// tiles, up to the numbering of arcs and faces.
Skeleton stitch(std::span<const TileGraph> tiles, std::span<const PointKey> cuts,
                const TraceOptions& options);

}  // namespace rattan::layout
