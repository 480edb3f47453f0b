// SPDX-License-Identifier: MIT
#pragma once

// The repaired scan as tiles: what ingest leaves in the store and every later stage starts from.

#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/store.h"
#include "engine/core/tile_layout.h"
#include "engine/core/types.h"
#include "engine/mesh/scan_sink.h"

namespace rattan {

namespace fields {
/// Positions relative to ScanMesh::origin, in ScanMesh::unit; owned vertices then halo.
inline constexpr Field<Vec3f> kPosition{"mesh/position"};
/// Every triangle with an owned corner. First the owned ones (those whose lowest global vertex is
/// owned), ascending by global corner triple, each rotated so that its lowest vertex comes first;
/// then the others, in the same order of triples.
inline constexpr Field<LocalTriangle> kTriangle{"mesh/triangle"};
/// Per owned vertex: bit 0, the vertex lies on the boundary.
inline constexpr Field<std::uint8_t> kVertexFlag{"mesh/vertex_flag"};
/// Colours of owned vertices, then halo; only where ScanMesh::has_colours.
inline constexpr Field<Rgba> kColour{"mesh/colour"};
inline constexpr HaloFields kMeshHalo{{"mesh/halo_ids"}, {"mesh/halo_slots"}, {"mesh/border"}};
}  // namespace fields

inline constexpr std::uint8_t kOnBoundary = 1;

struct TileTriangles {
  std::uint64_t first = 0;     ///< global id of the first owned triangle
  std::uint32_t owned = 0;     ///< triangles owned by the tile
  std::uint32_t touching = 0;  ///< all triangles in the tile's chunk
};

/// What was repaired, for the report.
struct RepairCounts {
  std::uint64_t degenerate_triangles = 0;  ///< repeated an index, also after merging; dropped
  std::uint64_t duplicate_triangles = 0;   ///< dropped
  std::uint64_t non_manifold_edges = 0;    ///< cut open
  std::uint64_t split_vertices = 0;        ///< extra copies made of non-manifold vertices
  std::uint64_t isolated_vertices = 0;     ///< dropped
  std::uint64_t flipped_triangles = 0;     ///< reoriented
  std::uint64_t one_sided_components = 0;  ///< could not be oriented; cut open where they turn
  std::uint64_t triangle_soup = 0;        ///< 1: triangles shared no vertices, so equal ones merged
  std::uint64_t merged_vertices = 0;      ///< became one with another at the same position
  std::uint64_t non_finite_vertices = 0;  ///< dropped with their triangles
  std::uint64_t non_finite_triangles = 0;
  std::uint64_t dropped_components = 0;  ///< too small, on request
  std::uint64_t dropped_triangles = 0;   ///< of those
  std::uint64_t filled_holes = 0;        ///< boundary loops closed on request
  std::uint64_t filled_triangles = 0;    ///< made for that
};

/// f(name, counter) for each, in the order of the report.
template <class Counts, class F>
void for_each_count(Counts& r, const F& f) {
  f("degenerate_triangles", r.degenerate_triangles);
  f("duplicate_triangles", r.duplicate_triangles);
  f("non_manifold_edges", r.non_manifold_edges);
  f("split_vertices", r.split_vertices);
  f("isolated_vertices", r.isolated_vertices);
  f("flipped_triangles", r.flipped_triangles);
  f("one_sided_components", r.one_sided_components);
  f("triangle_soup", r.triangle_soup);
  f("merged_vertices", r.merged_vertices);
  f("non_finite_vertices", r.non_finite_vertices);
  f("non_finite_triangles", r.non_finite_triangles);
  f("dropped_components", r.dropped_components);
  f("dropped_triangles", r.dropped_triangles);
  f("filled_holes", r.filled_holes);
  f("filled_triangles", r.filled_triangles);
}

/// Topology of the repaired scan.
struct ScanTopology {
  std::uint64_t vertices = 0;
  std::uint64_t edges = 0;
  std::uint64_t triangles = 0;
  std::uint64_t components = 0;
  std::uint64_t boundary_loops = 0;
  std::int64_t euler() const {
    return static_cast<std::int64_t>(vertices) - static_cast<std::int64_t>(edges) +
           static_cast<std::int64_t>(triangles);
  }
};

/// The part of a scan that is always in memory (about 50 bytes a tile). Every triangle is manifold
/// and consistently oriented; every vertex has exactly one fan of triangles.
struct ScanMesh {
  TileLayout layout;
  std::vector<TileTriangles> triangles;
  /// File coordinates are stored positions times `unit` plus `origin`. The unit is 1 unless the
  /// scan is so large or so small that products of lengths would leave the range of 32-bit floats;
  /// then a power of two near its size. Everything below and all that later stages measure is in
  /// it.
  double unit = 1.0;
  Vec3d origin = Vec3d::Zero();
  bool has_colours = false;
  Vec3d box_min = Vec3d::Zero();  ///< of stored positions
  Vec3d box_max = Vec3d::Zero();
  ScanTopology topology;
  RepairCounts repaired;
  double area = 0.0;  ///< of all triangles
  double mean_edge_length = 0.0;

  double diagonal() const { return (box_max - box_min).norm(); }
};

/// One tile's mesh, pinned.
struct TileMesh {
  TileExtent extent;
  TileTriangles counts;
  ChunkView<Vec3f> positions;          ///< extent.owned + extent.halo
  ChunkView<LocalTriangle> triangles;  ///< counts.touching
  ChunkView<std::uint64_t> halo_ids;   ///< extent.halo

  std::uint32_t local_vertices() const { return extent.owned + extent.halo; }
  std::uint64_t global_id(std::uint32_t local) const {
    return local < extent.owned ? extent.first + local : halo_ids[local - extent.owned];
  }
};

TileMesh load_tile(Store& store, const ScanMesh& mesh, TileId tile);

/// In-memory ingest for tests and small callers: tiles a manifold, consistently oriented mesh given
/// as arrays, in the given vertex order (no curve sorting, no repair). Writes the fields above.
ScanMesh tile_indexed_mesh(Store& store, std::span<const Vec3d> positions,
                           std::span<const std::array<std::uint32_t, 3>> triangles,
                           std::uint32_t tile_size);

}  // namespace rattan
