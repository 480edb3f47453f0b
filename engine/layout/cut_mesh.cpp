// SPDX-License-Identifier: MIT
#include "engine/layout/cut_mesh.h"

#include <algorithm>

#include "engine/core/errors.h"

namespace rattan::layout {

CutMesh::CutMesh(std::span<const Vec3d> position,
                 std::span<const std::array<std::uint32_t, 3>> triangle)
    : position_(position.begin(), position.end()), wall_vertex_(position.size(), 0) {
  reserve(position.size() * 2, triangle.size() * 3, triangle.size() * 2);
  for (std::size_t v = 0; v < position.size(); ++v) {
    add_vertex();
  }
  for (const auto& t : triangle) {
    for (const std::uint32_t v : t) {
      ensure(v < position.size(), "a chart's triangle names a vertex that is not there");
    }
    ensure(t[0] != t[1] && t[1] != t[2] && t[2] != t[0],
           "a chart's triangle has three different vertices");
    const FaceHandle f =
        add_face(VertexHandle(static_cast<int>(t[0])), VertexHandle(static_cast<int>(t[1])),
                 VertexHandle(static_cast<int>(t[2])));
    ensure(f.is_valid(), "a chart is a manifold");
  }
  std::size_t rim_edges = 0;
  HalfedgeHandle first;
  for (int h = 0; h < static_cast<int>(n_halfedges()); ++h) {
    const HalfedgeHandle half(h);
    if (is_boundary(half)) {
      ++rim_edges;
      if (!first.is_valid() || from_vertex_handle(half) < from_vertex_handle(first)) {
        first = half;
      }
    }
  }
  ensure(first.is_valid() && n_vertices() + n_faces() == n_edges() + 1, "a chart is a disk");
  // Outside, the rim is walked against its order.
  HalfedgeHandle h = first;
  do {
    const VertexHandle v = from_vertex_handle(h);
    ensure(!is_wall(v), "a chart's rim meets each of its vertices once");
    make_wall(v);
    rim_.push_back(v);
    h = next(h);
  } while (h != first);
  ensure(rim_.size() == rim_edges, "a chart has one boundary loop");
  std::reverse(rim_.begin() + 1, rim_.end());
}

VertexHandle CutMesh::cut_edge(HalfedgeHandle h, double share) {
  const Vec3d p = point(h, share);
  const VertexHandle v = add_vertex();
  made_.push_back({static_cast<std::uint32_t>(from_vertex_handle(h).idx()),
                   static_cast<std::uint32_t>(to_vertex_handle(h).idx()), share});
  position_.push_back(p);
  wall_vertex_.push_back(0);
  split(edge_handle(h), v);
  return v;
}

void CutMesh::make_wall(EdgeHandle e) {
  if (wall_edge_.size() < n_edges()) {
    wall_edge_.resize(n_edges(), 0);
  }
  wall_edge_[e.idx()] = 1;
}

double CutMesh::length(EdgeHandle e) const {
  const HalfedgeHandle h = halfedge_handle(e, 0);
  return (position(to_vertex_handle(h)) - position(from_vertex_handle(h))).norm();
}

bool CutMesh::contains(FaceHandle f, VertexHandle v) const {
  const HalfedgeHandle h = halfedge_handle(f);
  return to_vertex_handle(h) == v || from_vertex_handle(h) == v || to_vertex_handle(next(h)) == v;
}

}  // namespace rattan::layout
