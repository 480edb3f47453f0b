// SPDX-License-Identifier: MIT
#pragma once

// The vertex graph of the scan: per tile, one row per owned vertex, its neighbours in the order of
// its fan of triangles. Consecutive neighbours a, b of vertex i span the triangle (i, a, b), so
// later passes need no triangles: rows and positions are enough for weights, normals and curvature.

#include <bit>
#include <cstdint>
#include <emmintrin.h>
#include <span>
#include <vector>

#include "engine/core/task_graph.h"
#include "engine/mesh/tile_mesh.h"

namespace rattan {

namespace fields {
/// owned + 1 offsets into the half-edges of the tile.
inline constexpr Field<std::uint32_t> kRowBegin{"graph/row_begin"};
/// Tile-local vertex at the end of each half-edge. Counter-clockwise; an interior row starts with
/// its lowest global neighbour and closes upon itself, a boundary row runs from boundary to
/// boundary.
inline constexpr Field<std::uint32_t> kNeighbor{"graph/neighbor"};
/// Weight w_ij > 0 of each half-edge; the two of an edge are equal to the last bit.
inline constexpr Field<float> kEdgeWeight{"graph/weight"};
/// Sum of w_ij over the row, per owned vertex.
inline constexpr Field<float> kDiagonal{"graph/diagonal"};
}  // namespace fields

/// Rows of one tile under construction.
struct VertexFans {
  std::vector<std::uint32_t> row_begin;
  std::vector<std::uint32_t> neighbor;
};

/// A tile's rows, pinned.
struct FanView {
  ChunkView<std::uint32_t> row_begin;
  ChunkView<std::uint32_t> neighbor;
  ChunkView<std::uint8_t> flags;

  void load(Store& store, TileId tile);
  std::uint32_t owned() const { return static_cast<std::uint32_t>(flags.size()); }
};

/// Where `vertex` comes first in `neighbor` at or after `begin`, the start of a row that holds it.
/// Eight at a time: where in its row a neighbour comes is as good as random, and a loop over them
/// would guess its end wrong nearly every time.
inline std::uint32_t find_neighbor(std::span<const std::uint32_t> neighbor, std::uint32_t begin,
                                   std::uint32_t vertex) {
  const __m128i wanted = _mm_set1_epi32(static_cast<int>(vertex));
  for (; begin + 8 <= neighbor.size(); begin += 8) {
    const auto* at = reinterpret_cast<const __m128i*>(neighbor.data() + begin);
    const __m128i first = _mm_cmpeq_epi32(_mm_loadu_si128(at), wanted);
    const __m128i second = _mm_cmpeq_epi32(_mm_loadu_si128(at + 1), wanted);
    const auto hits = static_cast<unsigned>(_mm_movemask_ps(_mm_castsi128_ps(first)) |
                                            _mm_movemask_ps(_mm_castsi128_ps(second)) << 4);
    if (hits != 0) {
      return begin + static_cast<std::uint32_t>(std::countr_zero(hits));
    }
  }
  while (neighbor[begin] != vertex) {
    ++begin;
  }
  return begin;
}

/// Sorts the triangles of one tile into fans. Linear time; needs manifold vertices (InternalError).
VertexFans build_fans(const TileMesh& mesh);

/// As kRowBegin and kNeighbor.
void write_fans(Store& store, TileId tile, const VertexFans& fans);

/// One pass: writes kRowBegin and kNeighbor.
void build_vertex_graph(Store& store, const ScanMesh& mesh, TaskGraph& tasks);

/// Which energy the edge weights belong to (PGP 2.4 and Appendix B).
enum class EdgeEnergy {
  kTriangle,  ///< integrated over triangles: half the cotangents, clamped from below
  kEdge,      ///< every edge of every triangle counts the same
};

/// Bounds of the cotangent weights: scans have 12-14 % of edges below zero (down to -260), which
/// would make the quadratic form indefinite.
inline constexpr double kLowestWeight = 0.02;
inline constexpr double kHighestWeight = 50.0;
/// Weight of an edge per triangle with EdgeEnergy::kEdge: that of an equilateral triangle, so that
/// the norm penalty means the same for both energies.
inline constexpr double kUniformWeight = 0.28867513459481287;

/// Half the cotangent of the angle at `apex` of the triangle (apex, p, q); finite for every
/// triangle, the same to the last bit with p and q swapped.
inline double half_cotangent(const Vec3d& apex, const Vec3d& p, const Vec3d& q) {
  const Vec3d u = p - apex;
  const Vec3d v = q - apex;
  const double twice_area = u.cross(v).norm();
  // A sliver's angle is taken as if its height were a millionth of its size.
  const double floor_area = 1e-6 * (u.squaredNorm() + v.squaredNorm()) + 1e-300;
  return 0.5 * u.dot(v) / (twice_area > floor_area ? twice_area : floor_area);
}

/// Clamped weights of all half-edges of a tile, and their row sums. `positions`: owned then halo.
void fan_weights(const FanView& fans, std::span<const Vec3f> positions, EdgeEnergy energy,
                 std::vector<float>& weight, std::vector<float>& diagonal);

}  // namespace rattan
