// SPDX-License-Identifier: MIT
#pragma once

// The combinatorial verifier: what an indexed polygon mesh is, by sorting alone.

#include <cstdint>

#include "engine/remesh/polygon_mesh.h"

namespace rattan {

struct MeshTopology {
  std::uint64_t vertices = 0;  ///< that a face refers to
  std::uint64_t edges = 0;     ///< pairs of vertices
  std::uint64_t faces = 0;
  std::uint64_t components = 0;
  std::uint64_t boundary_loops = 0;
  std::int64_t euler() const {
    return static_cast<std::int64_t>(vertices) - static_cast<std::int64_t>(edges) +
           static_cast<std::int64_t>(faces);
  }

  // Violations; all zero in a valid remesh.
  std::uint64_t out_of_range = 0;     ///< faces that name a vertex that doesn't exist
  std::uint64_t bad_degree = 0;       ///< faces of other than three or four corners
  std::uint64_t repeated_vertex = 0;  ///< faces that repeat a vertex
  std::uint64_t duplicate_faces = 0;  ///< faces on the vertices of an earlier face
  std::uint64_t non_manifold_edges =
      0;  ///< pairs of vertices joined by sides of three faces or more
  std::uint64_t inconsistent_edges = 0;     ///< two faces run along it in the same direction
  std::uint64_t non_manifold_vertices = 0;  ///< the faces around it form several fans
  std::uint64_t valence_two = 0;            ///< interior vertices of valence two
  std::uint64_t short_loops = 0;            ///< boundary loops of fewer than three edges
  std::uint64_t unreferenced = 0;           ///< vertices without a face
  /// Quads both of whose diagonals join vertices that an edge joins: no triangle format holds them.
  std::uint64_t undividable_quads = 0;

  /// A mesh that its faces' vertices describe wholly.
  bool simple() const {
    return out_of_range + bad_degree + repeated_vertex + duplicate_faces + non_manifold_edges +
               inconsistent_edges + non_manifold_vertices + short_loops + unreferenced ==
           0;
  }
  bool clean() const { return simple() && valence_two + undividable_quads == 0; }
};

/// Two edges that join the same two vertices show as a non-manifold edge: an indexed mesh knows
/// edges by their ends alone. If out_of_range isn't zero nothing else is counted. Linear memory,
/// time of one sort of the corners.
MeshTopology check_topology(const PolygonMesh& mesh);

}  // namespace rattan
