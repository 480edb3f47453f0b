// SPDX-License-Identifier: MIT
#include "engine/remesh/edge_sort.h"

#include <algorithm>

#include "engine/core/errors.h"

namespace rattan {

std::vector<FaceSide> sorted_sides(const PolygonMesh& mesh) {
  ensure(mesh.corners.size() < 0xffffffffU, "a remesh has fewer than 2^32 corners");
  // Buckets by the lower vertex, then short sorts.
  const std::size_t vertices = mesh.vertex_count();
  std::vector<std::uint32_t> begin(vertices + 1, 0);
  const auto each_side = [&](const auto& visit) {
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
      const auto first = static_cast<std::uint32_t>(mesh.face_begin[f]);
      const auto last = static_cast<std::uint32_t>(mesh.face_begin[f + 1]);
      for (std::uint32_t c = first; c < last; ++c) {
        const std::uint32_t next = c + 1 == last ? first : c + 1;
        const std::uint32_t a = mesh.corners[c], b = mesh.corners[next];
        visit(FaceSide{std::min(a, b), std::max(a, b), c, next, static_cast<std::uint32_t>(f)});
      }
    }
  };
  each_side([&](const FaceSide& side) { ++begin[side.low + 1]; });
  for (std::size_t v = 0; v < vertices; ++v) {
    begin[v + 1] += begin[v];
  }
  std::vector<FaceSide> sides(mesh.corners.size());
  std::vector<std::uint32_t> fill(begin.begin(), begin.end() - 1);
  each_side([&](const FaceSide& side) { sides[fill[side.low]++] = side; });
  for (std::size_t v = 0; v < vertices; ++v) {
    std::sort(sides.begin() + begin[v], sides.begin() + begin[v + 1],
              [](const FaceSide& a, const FaceSide& b) {
                return a.high != b.high ? a.high < b.high : a.corner < b.corner;
              });
  }
  return sides;
}

}  // namespace rattan
