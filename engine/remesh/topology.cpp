// SPDX-License-Identifier: MIT
#include "engine/remesh/topology.h"

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "engine/layout/disjoint_sets.h"
#include "engine/remesh/edge_sort.h"

namespace rattan {
namespace {

using layout::DisjointSets;

/// Counts faces that repeat a vertex, and faces on the same vertices as an earlier one.
void check_faces(const PolygonMesh& mesh, MeshTopology& result) {
  struct Key {
    std::array<std::uint32_t, 4> smallest;
    std::uint32_t face;
  };
  std::vector<std::uint32_t> sorted = mesh.corners;
  std::vector<Key> keys(mesh.face_count());
  const auto span_of = [&](std::uint32_t f) {
    return std::span<const std::uint32_t>(sorted.data() + mesh.face_begin[f], mesh.degree(f));
  };
  for (std::uint32_t f = 0; f < mesh.face_count(); ++f) {
    const auto begin = sorted.begin() + static_cast<std::ptrdiff_t>(mesh.face_begin[f]);
    const auto end = sorted.begin() + static_cast<std::ptrdiff_t>(mesh.face_begin[f + 1]);
    std::sort(begin, end);
    result.repeated_vertex += std::adjacent_find(begin, end) != end;
    result.bad_degree += end - begin != 3 && end - begin != 4;
    keys[f].face = f;
    keys[f].smallest.fill(0xffffffffU);
    std::copy_n(begin, std::min<std::ptrdiff_t>(4, end - begin), keys[f].smallest.begin());
  }
  std::sort(keys.begin(), keys.end(), [&](const Key& a, const Key& b) {
    if (a.smallest != b.smallest) {
      return a.smallest < b.smallest;
    }
    const auto x = span_of(a.face), y = span_of(b.face);
    return std::lexicographical_compare(x.begin(), x.end(), y.begin(), y.end());
  });
  for (std::size_t i = 1; i < keys.size(); ++i) {
    const auto x = span_of(keys[i - 1].face), y = span_of(keys[i].face);
    result.duplicate_faces += std::equal(x.begin(), x.end(), y.begin(), y.end());
  }
}

std::uint64_t count_undividable(const PolygonMesh& mesh, const std::vector<FaceSide>& sides) {
  const auto joined = [&](std::uint32_t a, std::uint32_t b) {
    const std::pair<std::uint32_t, std::uint32_t> key = std::minmax(a, b);
    const auto at = std::lower_bound(
        sides.begin(), sides.end(), key,
        [](const FaceSide& s, const auto& k) { return std::pair(s.low, s.high) < k; });
    return at != sides.end() && at->low == key.first && at->high == key.second;
  };
  std::uint64_t count = 0;
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const auto v = mesh.face(f);
    count += v.size() == 4 && joined(v[0], v[2]) && joined(v[1], v[3]);
  }
  return count;
}

}  // namespace

MeshTopology check_topology(const PolygonMesh& mesh) {
  MeshTopology result;
  const std::size_t vertices = mesh.vertex_count();
  const std::size_t corners = mesh.corners.size();
  result.faces = mesh.face_count();
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    const auto face = mesh.face(f);
    result.out_of_range +=
        std::any_of(face.begin(), face.end(), [&](std::uint32_t v) { return v >= vertices; });
  }
  if (result.out_of_range > 0) {
    return result;
  }
  check_faces(mesh, result);

  constexpr std::uint8_t kUsed = 1, kBorder = 2;
  std::vector<std::uint8_t> state(vertices, 0);
  std::vector<std::uint32_t> valence(vertices, 0);
  DisjointSets components(vertices);
  DisjointSets fans(corners);
  std::vector<FaceSide> border;
  const std::vector<FaceSide> sides = sorted_sides(mesh);
  for (std::size_t i = 0; i < sides.size();) {
    const FaceSide& a = sides[i];
    std::size_t j = i + 1;
    while (j < sides.size() && sides[j].low == a.low && sides[j].high == a.high) {
      ++j;
    }
    ++result.edges;
    ++valence[a.low];
    ++valence[a.high];
    state[a.low] |= kUsed;
    state[a.high] |= kUsed;
    components.unite(a.low, a.high);
    if (j - i == 1) {
      state[a.low] |= kBorder;
      state[a.high] |= kBorder;
      border.push_back(a);
    } else if (j - i == 2) {
      const FaceSide& b = sides[i + 1];
      if (mesh.corners[a.corner] == mesh.corners[b.corner]) {
        ++result.inconsistent_edges;
        fans.unite(a.corner, b.corner);
        fans.unite(a.next, b.next);
      } else {
        fans.unite(a.corner, b.next);
        fans.unite(a.next, b.corner);
      }
    } else {
      ++result.non_manifold_edges;
    }
    i = j;
  }

  result.undividable_quads = count_undividable(mesh, sides);

  std::vector<std::uint8_t> seen(vertices, 0);
  for (std::uint32_t c = 0; c < corners; ++c) {
    if (fans.find(c) == c) {
      std::uint8_t& count = seen[mesh.corners[c]];
      result.non_manifold_vertices += count == 1;
      count = static_cast<std::uint8_t>(std::min(2, count + 1));
    }
  }
  for (std::uint32_t v = 0; v < vertices; ++v) {
    if (state[v] == 0) {
      ++result.unreferenced;
      continue;
    }
    ++result.vertices;
    result.components += components.find(v) == v;
    result.valence_two += valence[v] <= 2 && (state[v] & kBorder) == 0;
  }

  // A boundary loop passes from edge to edge through the fan that they share.
  DisjointSets loops(corners);
  std::vector<std::uint32_t> length(corners, 0);
  for (const FaceSide& side : border) {
    loops.unite(fans.find(side.corner), fans.find(side.next));
  }
  for (const FaceSide& side : border) {
    ++length[loops.find(fans.find(side.corner))];
  }
  for (const std::uint32_t n : length) {
    result.boundary_loops += n > 0;
    result.short_loops += n == 1 || n == 2;
  }
  return result;
}

}  // namespace rattan
