// SPDX-License-Identifier: MIT
#pragma once

// Reconstruction of theta and phi from the periodic unknowns (PGP 3.1) and the singularities of the
// result (PGP 3.2). All integers live on undirected edges, always from the lower to the higher
// global vertex, so that every tile and every triangle see the same ones.

#include <cstdint>
#include <span>
#include <vector>

#include "engine/mesh/tile_mesh.h"
#include "engine/param/edge_gauge.h"
#include "engine/solve/system.h"

namespace rattan {

/// (theta, phi) of a vertex in its own gauge, each in (-pi, pi].
struct PhaseAngles {
  double theta = 0.0;
  double phi = 0.0;
};

/// Carries coordinates of the edge's far end into the gauge of its near end: turn by r quarter
/// turns, (a, b) -> (b, -a) for r = 1, then add s and t whole periods.
struct EdgeTransport {
  std::int32_t s = 0;
  std::int32_t t = 0;
  std::uint32_t r = 0;
  friend bool operator==(const EdgeTransport&, const EdgeTransport&) = default;
};

/// r quarter turns of the pair (a, b); exact for integers and doubles.
template <class Number>
void quarter_turns(std::uint32_t r, Number& a, Number& b) {
  const Number x = a;
  const Number y = b;
  switch (r & 3U) {
    case 0:
      break;
    case 1:
      a = y;
      b = -x;
      break;
    case 2:
      a = -x;
      b = -y;
      break;
    default:
      a = -y;
      b = x;
      break;
  }
}

/// outer(inner(x)).
EdgeTransport compose(const EdgeTransport& outer, const EdgeTransport& inner);
EdgeTransport inverse(const EdgeTransport& transport);

/// Angles of a solution; values that are not finite count as zero.
PhaseAngles phase_angles(const PairValue& x);

/// Algorithm 1 along lower -> higher global vertex: the periods that bring the far angles closest
/// to what the gauge asks for.
EdgeTransport edge_transport(const EdgeGauge& gauge, const PhaseAngles& lower,
                             const PhaseAngles& higher);

inline constexpr std::uint32_t kNoSide = 0xffffffffU;

/// An edge of the tile. A side is 3 * triangle + corner and runs from that corner to the next.
struct TileEdge {
  std::uint32_t lo = 0;           ///< tile-local vertex with the lower global id
  std::uint32_t hi = 0;           ///< the other one
  std::uint32_t left = kNoSide;   ///< side that runs lo -> hi
  std::uint32_t right = kNoSide;  ///< side that runs hi -> lo
  EdgeTransport transport;        ///< from hi into the gauge of lo
};

/// Coordinates of all triangles in a tile's chunk, in about 66 bytes a triangle.
struct TileCoordinates {
  std::vector<std::uint64_t> ids;         ///< global id of each local vertex
  std::vector<PhaseAngles> angles;        ///< one a local vertex
  std::vector<std::uint8_t> pins;         ///< one a local vertex: VertexFrame::pins
  std::vector<TileEdge> edges;            ///< grouped by lo, ascending by local numbers
  std::vector<std::uint32_t> edge_begin;  ///< local vertices + 1: the edges whose lo it is
  std::vector<std::uint32_t> side_edge;   ///< 3 a triangle of the chunk

  /// Carries coordinates of the side's end into the gauge of its start.
  EdgeTransport side_transport(std::uint32_t side) const;
  /// Once around the triangle, in the gauge of its first corner; the identity if it is closed.
  EdgeTransport holonomy(std::uint32_t triangle) const;
  /// The edge between two local vertices; kNoSide if the tile has none.
  std::uint32_t find_edge(std::uint32_t a, std::uint32_t b) const;
};

/// `frames`, `phases`: one a local vertex (owned, then halo). `omega`: the period, a length.
/// Throws InternalError if the tile's triangles are not manifold and consistently oriented.
TileCoordinates tile_coordinates(const TileMesh& mesh, std::span<const VertexFrame> frames,
                                 std::span<const PairValue> phases, double omega);

/// PGP 3.2. Sums over the tiles' owned elements (a triangle and an edge belong to the tile of their
/// lowest vertex) are those of the scan.
struct SingularityCounts {
  std::uint64_t vertices = 0;            ///< interior, with an open one-ring
  std::uint64_t edges = 0;               ///< seen differently by their two triangles
  std::uint64_t field_triangles = 0;     ///< r: quarter turns don't close
  std::uint64_t phase_triangles = 0;     ///< s: closed quarter turns, periods don't close
  std::uint64_t negative_triangles = 0;  ///< closed, but folded over in parameter space

  SingularityCounts& operator+=(const SingularityCounts& o);
  friend bool operator==(const SingularityCounts&, const SingularityCounts&) = default;
};

/// In the order of PGP 3.2; a field singularity may be a phase singularity, too, and counts once.
enum class TriangleKind : std::uint8_t {
  kRegular = 0,
  kField = 1,     ///< quarter turns don't close
  kPhase = 2,     ///< periods don't close
  kNegative = 3,  ///< folded over in parameter space
};

/// Where they are.
struct TileSingularities {
  std::vector<TriangleKind> triangles;        ///< of the tile's owned triangles
  std::vector<std::uint8_t> vertices;         ///< of its owned vertices: 1 where singular
  std::vector<std::uint8_t> edges_at_vertex;  ///< likewise: singular edges that end there
  std::vector<std::uint32_t> edges;           ///< singular ones, of TileCoordinates::edges
};

/// `where`: filled in if not null.
SingularityCounts count_singularities(const TileMesh& mesh, const TileCoordinates& coordinates,
                                      TileSingularities* where = nullptr);

}  // namespace rattan
