// SPDX-License-Identifier: MIT
#pragma once

// Distances over a chart, along ways that join vertices and middles of edges within triangles.

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "engine/layout/cut_mesh.h"

namespace rattan::layout {

/// Dijkstra's search over vertices and middles of edges: upper bounds of distances on the surface,
/// mostly within a tenth. No way passes a wall, or a vertex on one. Memory is kept between runs, so
/// that one search may serve many times. Valid until the mesh is changed.
class SurfaceSearch {
 public:
  /// Vertex v, or the number of vertices + edge.
  using Node = std::uint32_t;
  static constexpr Node kNone = 0xffffffffU;
  struct Source {
    Node node = 0;
    double distance = 0;
  };

  explicit SurfaceSearch(const CutMesh& mesh);

  /// Sources may be on walls, as the target may; stops at the target. Lengths, in the mesh's unit.
  void run(std::span<const Source> sources, Node target = kNone);
  /// From the nearest source; infinite if there is no way.
  double distance(Node node) const { return distance_[node]; }
  /// The next node towards the source; kNone there.
  Node towards_source(Node node) const { return previous_[node]; }

  Node node(VertexHandle v) const { return static_cast<Node>(v.idx()); }
  Node node(EdgeHandle e) const { return vertices_ + static_cast<Node>(e.idx()); }
  bool is_vertex(Node n) const { return n < vertices_; }
  VertexHandle vertex(Node n) const { return VertexHandle(static_cast<int>(n)); }
  EdgeHandle edge(Node n) const { return EdgeHandle(static_cast<int>(n - vertices_)); }

 private:
  void relax(Node from, Node to);
  bool open(VertexHandle v) const { return !mesh_->is_wall(v) || node(v) == target_; }

  const CutMesh* mesh_;
  Node vertices_;
  Node target_ = kNone;
  std::vector<Vec3d> point_;
  std::vector<double> distance_;
  std::vector<Node> previous_;
  std::vector<std::pair<double, Node>> heap_;
};

}  // namespace rattan::layout
