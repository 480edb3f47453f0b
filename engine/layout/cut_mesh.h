// SPDX-License-Identifier: MIT
#pragma once

// A chart while it is cut: its connectivity, and the walls that further cuts keep off.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <OpenMesh/Core/Mesh/TriConnectivity.hh>

#include "engine/core/types.h"
#include "engine/layout/split_chart.h"

namespace rattan::layout {

using OpenMesh::EdgeHandle;
using OpenMesh::FaceHandle;
using OpenMesh::HalfedgeHandle;
using OpenMesh::VertexHandle;

class CutMesh : public OpenMesh::TriConnectivity {
 public:
  /// The rim's vertices are walls from the start. Throws InternalError unless it is a disk.
  CutMesh(std::span<const Vec3d> position, std::span<const std::array<std::uint32_t, 3>> triangle);

  /// A vertex at (1 - share) from + share to, in an edge inside. Becomes no wall by itself.
  VertexHandle cut_edge(HalfedgeHandle h, double share);
  void make_wall(VertexHandle v) { wall_vertex_[v.idx()] = 1; }
  void make_wall(EdgeHandle e);

  bool is_wall(VertexHandle v) const { return wall_vertex_[v.idx()] != 0; }
  /// Of the rim, or between neighbours on a spoke.
  bool is_wall(EdgeHandle e) const {
    return is_boundary(e) ||
           (e.idx() < static_cast<int>(wall_edge_.size()) && wall_edge_[e.idx()] != 0);
  }

  const Vec3d& position(VertexHandle v) const { return position_[v.idx()]; }
  const std::vector<Vec3d>& positions() const { return position_; }
  Vec3d point(HalfedgeHandle h, double share) const {
    return (1.0 - share) * position(from_vertex_handle(h)) + share * position(to_vertex_handle(h));
  }
  double length(EdgeHandle e) const;
  const std::vector<SplitDisk::Made>& made() const { return made_; }
  /// In their order, the surface on the left; the first vertex is the lowest.
  const std::vector<VertexHandle>& rim() const { return rim_; }

  bool contains(FaceHandle f, VertexHandle v) const;
  HalfedgeHandle next(HalfedgeHandle h) const { return next_halfedge_handle(h); }
  HalfedgeHandle opposite(HalfedgeHandle h) const { return opposite_halfedge_handle(h); }

 private:
  std::vector<Vec3d> position_;
  std::vector<SplitDisk::Made> made_;
  std::vector<std::uint8_t> wall_vertex_;
  std::vector<std::uint8_t> wall_edge_;  ///< edges behind its end are no walls
  std::vector<VertexHandle> rim_;
};

}  // namespace rattan::layout
