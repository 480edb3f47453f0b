// SPDX-License-Identifier: MIT
#pragma once

// The repaired scan as tiles: what ingest leaves in the store and every later stage starts from.

#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/store.h"
#include "engine/core/tile_layout.h"
#include "engine/core/types.h"

namespace rattan {

namespace fields {
/// Positions relative to ScanMesh::origin, file units; owned vertices then halo.
inline constexpr Field<Vec3f> kPosition{"mesh/position"};
/// Every triangle with an owned corner. First the owned ones (those whose lowest global vertex is
/// owned), ascending by global corner triple, each rotated so that its lowest vertex comes first;
/// then the others, in the same order of triples.
inline constexpr Field<LocalTriangle> kTriangle{"mesh/triangle"};
/// Per owned vertex: bit 0, the vertex lies on the boundary.
inline constexpr Field<std::uint8_t> kVertexFlag{"mesh/vertex_flag"};
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
  std::uint64_t degenerate_triangles = 0;  ///< repeated an index; dropped
  std::uint64_t duplicate_triangles = 0;   ///< dropped
  std::uint64_t non_manifold_edges = 0;    ///< cut open
  std::uint64_t split_vertices = 0;        ///< extra copies made of non-manifold vertices
  std::uint64_t isolated_vertices = 0;     ///< dropped
  std::uint64_t flipped_triangles = 0;     ///< reoriented
  std::uint64_t merged_vertices = 0;
  std::uint64_t non_finite_vertices = 0;  ///< dropped with their triangles
};

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
  Vec3d origin = Vec3d::Zero();   ///< added to stored positions to get file coordinates
  Vec3d box_min = Vec3d::Zero();  ///< relative to origin
  Vec3d box_max = Vec3d::Zero();
  ScanTopology topology;
  RepairCounts repaired;
  double area = 0.0;  ///< of all triangles, units squared
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
