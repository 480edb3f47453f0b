// SPDX-License-Identifier: MIT
#pragma once

// Singularities of the field: by how many N-th turns it fails to close around a triangle.

#include <cstdint>
#include <span>

#include "engine/core/task_graph.h"
#include "engine/field/smoothing.h"

namespace rattan {

/// Index of the field within a triangle, in units of 1/N turns, corners counter-clockwise and in
/// any rotation. Summed over a closed surface: N times the Euler characteristic (if the normals
/// cover the sphere as those of the smooth surface do).
int triangle_index(const VertexFrame& a, const VertexFrame& b, const VertexFrame& c, int n);

struct FieldIndexCount {
  std::uint64_t positive = 0;  ///< triangles of positive index
  std::uint64_t negative = 0;
  std::int64_t sum = 0;  ///< of indices, in units of 1/N turns
};

/// One pass over kFrame; counts every triangle once.
FieldIndexCount count_field_singularities(Store& store, const ScanMesh& mesh, Symmetry symmetry,
                                          TaskGraph& tasks);

}  // namespace rattan
