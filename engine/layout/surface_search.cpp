// SPDX-License-Identifier: MIT
#include "engine/layout/surface_search.h"

#include <algorithm>
#include <functional>
#include <limits>

namespace rattan::layout {

SurfaceSearch::SurfaceSearch(const CutMesh& mesh)
    : mesh_(&mesh), vertices_(static_cast<Node>(mesh.n_vertices())) {
  const std::size_t nodes = mesh.n_vertices() + mesh.n_edges();
  distance_.resize(nodes);
  previous_.resize(nodes);
  point_.reserve(nodes);
  point_ = mesh.positions();
  for (int e = 0; e < static_cast<int>(mesh.n_edges()); ++e) {
    point_.push_back(mesh.point(mesh.halfedge_handle(EdgeHandle(e), 0), 0.5));
  }
}

void SurfaceSearch::relax(Node from, Node to) {
  const double d = distance_[from] + (point_[to] - point_[from]).norm();
  if (d < distance_[to]) {
    distance_[to] = d;
    previous_[to] = from;
    heap_.emplace_back(d, to);
    std::push_heap(heap_.begin(), heap_.end(), std::greater<>());
  }
}

void SurfaceSearch::run(std::span<const Source> sources, Node target) {
  target_ = target;
  std::fill(distance_.begin(), distance_.end(), std::numeric_limits<double>::infinity());
  std::fill(previous_.begin(), previous_.end(), kNone);
  heap_.clear();
  for (const Source& s : sources) {
    if (s.distance < distance_[s.node]) {
      distance_[s.node] = s.distance;
      heap_.emplace_back(s.distance, s.node);
    }
  }
  std::make_heap(heap_.begin(), heap_.end(), std::greater<>());
  // Nodes of equal distance leave the heap in their order, so ties do not depend on its layout.
  while (!heap_.empty()) {
    const double d = heap_.front().first;
    const Node n = heap_.front().second;
    std::pop_heap(heap_.begin(), heap_.end(), std::greater<>());
    heap_.pop_back();
    if (d > distance_[n]) {
      continue;
    }
    if (n == target_) {
      return;
    }
    const auto to_edge = [&](HalfedgeHandle h) {
      const EdgeHandle e = mesh_->edge_handle(h);
      if (!mesh_->is_wall(e)) {
        relax(n, node(e));
      }
    };
    if (is_vertex(n)) {
      // A way from a vertex to the middle of an edge there is the beginning of a longer one only.
      for (auto h = mesh_->cvoh_iter(vertex(n)); h.is_valid(); ++h) {
        if (!mesh_->is_wall(mesh_->edge_handle(*h)) && open(mesh_->to_vertex_handle(*h))) {
          relax(n, node(mesh_->to_vertex_handle(*h)));
        }
        if (!mesh_->is_boundary(*h)) {
          to_edge(mesh_->next(*h));
        }
      }
    } else {
      for (int side = 0; side < 2; ++side) {
        const HalfedgeHandle h = mesh_->halfedge_handle(edge(n), side);
        if (mesh_->is_boundary(h)) {
          continue;
        }
        const HalfedgeHandle second = mesh_->next(h);
        if (open(mesh_->to_vertex_handle(second))) {
          relax(n, node(mesh_->to_vertex_handle(second)));
        }
        to_edge(second);
        to_edge(mesh_->next(second));
      }
    }
  }
}

}  // namespace rattan::layout
