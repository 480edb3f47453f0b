// SPDX-License-Identifier: MIT
#pragma once

// From the cells of the arrangement to a conforming mesh of quads and few triangles.

#include <cstdint>
#include <span>

#include "engine/layout/cell_complex.h"
#include "engine/remesh/clean.h"
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
  /// Ends with one step of subdivision where a triangle is left: four quads a quad, three a
  /// triangle; ask for twice the side then.
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
  bool subdivided = false;
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

/// Divides each face around its centre into quads, one a corner, with a new vertex on each edge.
/// Keeps every guarantee above.
PolygonMesh subdivide_to_quads(PolygonMesh&& mesh);

/// Divides each quad whose scaled Jacobian (see quality.h) is at most `least` by its better
/// diagonal into two triangles, around a centre vertex into four if both diagonals are edges
/// already; keeps every guarantee above. Returns the number of quads divided.
std::uint64_t split_bad_quads(PolygonMesh& mesh, double least = 0.0);

}  // namespace rattan
