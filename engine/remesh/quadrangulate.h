// SPDX-License-Identifier: MIT
#pragma once

// From the cells of the arrangement to a conforming mesh of quads and few triangles.

#include <cstdint>
#include <span>

#include "engine/layout/cell_complex.h"
#include "engine/remesh/clean.h"
#include "engine/remesh/join_triangles.h"
#include "engine/remesh/polygon_mesh.h"

namespace rattan {

struct QuadrangulateOptions {
  /// Target length of a quad's side, in the mesh's unit; above zero.
  double side = 1.0;
  /// Edges shorter than this share of `side` are contracted (up to twice that where it pays).
  double contract_below = 0.4;
  /// Strips of at most so many quads between two triangles, or between a triangle and the boundary,
  /// are re-split.
  std::uint32_t pair_between = 4;
  /// The last triangles are joined by new lines (join_triangles.h); a component where that cannot
  /// be done, of a few faces at most, is subdivided instead.
  bool pure_quads = false;
};

struct QuadrangulateReport {
  CleanReport clean;
  std::uint64_t stars = 0;             ///< polygons divided around a new vertex
  std::uint64_t insets = 0;            ///< faces refined because nothing simpler was valid
  std::uint64_t triangles_split = 0;   ///< triangles after dividing the polygons
  std::uint64_t triangle_pairs = 0;    ///< pairs of triangles removed along strips
  std::uint64_t border_triangles = 0;  ///< triangles removed along strips to the boundary
  std::uint64_t balanced = 0;          ///< exchanges that left fewer irregular vertices
  std::uint64_t doublets = 0;          ///< vertices of valence two removed
  std::uint64_t collapsed = 0;         ///< quads taken out for the sake of valences
  JoinReport joined;                   ///< for pure quads
  std::uint64_t subdivided = 0;        ///< faces of components subdivided for pure quads
};

/// All faces have three or four corners; no face repeats a vertex, no two edges join the same
/// vertices, no two faces have the same vertices, no interior vertex has valence two, every
/// boundary loop has three edges or more, edges and vertices are manifold, orientation is
/// consistent. Components, boundary loops and the Euler characteristic are those of `cells`.
/// Vertices keep their order, new ones follow; vertex_flags are filled. `normals`: the surface's
/// unit normal at each vertex of `cells`, or empty to estimate them from the cells. The result
/// doesn't depend on the number of threads. Throws InternalError if `cells` isn't a valid complex.
PolygonMesh quadrangulate(CellComplex&& cells, const QuadrangulateOptions& options,
                          QuadrangulateReport& report, std::span<const Vec3d> normals = {});

/// About how many faces quadrangulate() makes of these cells: one a quad or triangle, (n - 2) / 2
/// of n corners. At least one.
double expected_faces(const CellComplex& cells);

/// Divides each face around its centre into quads, one a corner, with a new vertex on each edge.
/// Keeps every guarantee above. `chosen`: one a face, 0 for those to leave as they are; alike in a
/// component, or empty for all.
PolygonMesh subdivide_to_quads(PolygonMesh&& mesh, std::span<const std::uint8_t> chosen = {});

/// Divides each quad whose scaled Jacobian (see quality.h) is at most `least` by its better
/// diagonal into two triangles, around a centre vertex into four if both diagonals are edges
/// already; keeps every guarantee above. Returns the number of quads divided.
std::uint64_t split_bad_quads(PolygonMesh& mesh, double least = 0.0);

}  // namespace rattan
