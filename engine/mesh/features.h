// SPDX-License-Identifier: MIT
#pragma once

// Feature curves of the scan: sharp edges chained into curves, and boundary loops. Held in memory
// as a whole (about 80 bytes an edge): they are of the length of the curves, not of the scan.

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "engine/core/task_graph.h"
#include "engine/mesh/tile_mesh.h"

namespace rattan {

struct FeatureOptions {
  /// Look for sharp edges; boundary loops count as features anyway.
  bool creases = true;
  /// Turn of the normals across an edge, in degrees, from which it is sharp. A curve may run on
  /// along edges of 0.6 times that.
  double crease_degrees = 35.0;
  /// h, the side of a quad, a length: curves have to be some quads long to count.
  double side = 1.0;
  /// Curves that turn further have a corner there, in degrees.
  double corner_degrees = 45.0;
  /// Length within which the chords between the corners of a ragged curve follow it.
  double tolerance = 0.0;
  /// Of those; if there would be more, only what is sharper comes with the clear curves.
  std::size_t most_corners = std::numeric_limits<std::size_t>::max();
};

/// One edge of a feature curve; a global vertex id each, lo < hi.
struct FeatureEdge {
  std::uint64_t lo = 0;
  std::uint64_t hi = 0;
  std::uint32_t curve = 0;
  bool boundary = false;
  bool ragged = false;  ///< sharp, but too uneven for lines to follow: only kept as an edge
  Vec3f p_lo{0.0F, 0.0F, 0.0F};  ///< of the scan as it is, relative to its origin
  Vec3f p_hi{0.0F, 0.0F, 0.0F};
};

/// A vertex of a tile on feature curves.
struct FeatureMark {
  std::uint32_t vertex = 0;     ///< local, owned
  std::uint32_t neighbors = 0;  ///< along curves
  std::uint32_t first = 0;      ///< into TileFeatures::neighbor
  bool corner = false;
};

/// What a tile knows of the features at its owned vertices, ascending by vertex.
struct TileFeatures {
  std::vector<FeatureMark> marks;
  std::vector<std::uint32_t> neighbor;  ///< local

  std::span<const std::uint32_t> neighbors(const FeatureMark& m) const {
    return {neighbor.data() + m.first, m.neighbors};
  }
};

/// Immutable once made; all queries may run concurrently.
class FeatureSet {
 public:
  FeatureSet() = default;

  bool empty() const { return edges_.empty(); }
  std::uint64_t crease_edges() const { return crease_edges_; }
  std::uint32_t curve_count() const { return curves_; }
  /// Ascending by (lo, hi).
  std::span<const FeatureEdge> edges() const { return edges_; }
  /// Ascending: vertices where curves end, meet or turn sharply.
  std::span<const std::uint64_t> corners() const { return corners_; }
  bool is_corner(std::uint64_t vertex) const;
  /// A curve ends here on an open surface, and needn't where a line runs on.
  bool is_loose_end(std::uint64_t vertex) const;
  /// The scan is of an object with edges: so much of what is sharp lies on clear curves that the
  /// rest counts too. Else it is taken for relief or noise.
  bool has_clear_edges() const { return clear_; }

  /// Of the curves that lines follow: all but the ragged ones.
  TileFeatures of_tile(const TileExtent& extent, std::span<const std::uint64_t> halo_ids) const;
  /// The sharp edges (not those of the boundary) between a tile's local vertices, as local numbers.
  std::vector<std::array<std::uint32_t, 2>> tile_creases(const TileMesh& mesh) const;

 private:
  friend class FeatureBuilder;
  template <class A>
  friend void members_of(A& a, FeatureSet& s) {
    a(s.edges_);
    a(s.corners_);
    a(s.loose_ends_);
    a(s.all_vertices_);
    a(s.followed_corners_);
    a(s.vertices_);
    a(s.first_);
    a(s.neighbors_);
    a(s.crease_edges_);
    a(s.curves_);
    a(s.clear_);
  }
  std::vector<FeatureEdge> edges_;
  std::vector<std::uint64_t> corners_;
  std::vector<std::uint64_t> loose_ends_;    ///< ascending
  std::vector<std::uint64_t> all_vertices_;  ///< ascending
  // Of the curves that lines follow:
  std::vector<std::uint64_t> followed_corners_;  ///< ascending
  std::vector<std::uint64_t> vertices_;          ///< ascending
  std::vector<std::uint32_t> first_;             ///< vertices + 1, into neighbors_
  std::vector<std::uint64_t> neighbors_;         ///< global ids, ascending for each vertex
  std::uint64_t crease_edges_ = 0;
  std::uint32_t curves_ = 0;
  bool clear_ = false;
};

/// One pass over the tiles, two if there are clear edges; with `make_graph` it leaves the vertex
/// graph, too. An edge is a candidate if it is sharp as seen from both its ends: by its angle, and
/// clearly sharper than what else bends there. Candidates are chained; weak curves, short spurs and
/// short components go. If what remains is a fair share of all that is sharp, the rest of it comes
/// back as ragged curves. The result depends on neither tiles nor threads.
FeatureSet find_features(Store& store, const ScanMesh& mesh, const FeatureOptions& options,
                         TaskGraph& tasks, bool make_graph = false);

}  // namespace rattan
