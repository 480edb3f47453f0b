// SPDX-License-Identifier: MIT
#include "engine/layout/split_chart.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/core/errors.h"
#include "engine/layout/cut_mesh.h"
#include "engine/layout/geodesic_path.h"
#include "engine/layout/surface_search.h"

namespace rattan {

namespace {

using layout::CutMesh;
using layout::EdgeHandle;
using layout::FaceHandle;
using layout::HalfedgeHandle;
using layout::SurfaceSearch;
using layout::VertexHandle;

/// Among so many vertices at least the centre is chosen.
constexpr std::size_t kFewestInside = 12;
/// Edges inside longer than this, in parts of the square root of the area, leave it too little
/// choice of place; but not more than so many are halved.
constexpr double kLongEdge = 0.5;
constexpr int kMostHalved = 64;

void check_middles(const CutMesh& mesh, std::span<const std::uint32_t> middles) {
  ensure(middles.size() >= 2, "a split chart has two sides or more");
  std::vector<std::size_t> place(mesh.n_vertices(), mesh.n_vertices());
  for (std::size_t i = 0; i < mesh.rim().size(); ++i) {
    place[static_cast<std::size_t>(mesh.rim()[i].idx())] = i;
  }
  std::size_t around = 0;
  for (std::size_t i = 0; i < middles.size(); ++i) {
    const std::uint32_t a = middles[i];
    const std::uint32_t b = middles[(i + 1) % middles.size()];
    ensure(a < place.size() && place[a] < mesh.n_vertices() && b < place.size() &&
               place[b] < mesh.n_vertices(),
           "middles of sides are on the rim");
    const std::size_t step = (place[b] + mesh.rim().size() - place[a]) % mesh.rim().size();
    ensure(step >= 2, "there is a corner between two middles");
    around += step;
  }
  ensure(around == mesh.rim().size(), "middles of sides are in order");
}

/// Halves long edges inside, so that there is something to choose a centre from.
void refine_inside(CutMesh& mesh) {
  double area = 0;
  for (int f = 0; f < static_cast<int>(mesh.n_faces()); ++f) {
    const HalfedgeHandle h = mesh.halfedge_handle(FaceHandle(f));
    const Vec3d& a = mesh.position(mesh.from_vertex_handle(h));
    const Vec3d& b = mesh.position(mesh.to_vertex_handle(h));
    const Vec3d& c = mesh.position(mesh.to_vertex_handle(mesh.next(h)));
    area += 0.5 * (b - a).cross(c - a).norm();
  }
  const double long_edge = kLongEdge * std::sqrt(area);
  for (int halved = 0; halved < kMostHalved; ++halved) {
    EdgeHandle longest;
    double length = -1;
    for (int e = 0; e < static_cast<int>(mesh.n_edges()); ++e) {
      const double l = mesh.is_boundary(EdgeHandle(e)) ? -1 : mesh.length(EdgeHandle(e));
      if (l > length) {
        length = l;
        longest = EdgeHandle(e);
      }
    }
    ensure(longest.is_valid(), "a chart with four rim vertices has an edge inside");
    if (length <= long_edge && mesh.n_vertices() >= mesh.rim().size() + kFewestInside) {
      return;
    }
    mesh.cut_edge(mesh.halfedge_handle(longest, 0), 0.5);
  }
}

/// A vertex inside for which the distances to the middles are small compared with that to the rim.
VertexHandle find_centre(const CutMesh& mesh, std::span<const std::uint32_t> middles) {
  SurfaceSearch search(mesh);
  const std::size_t n = mesh.n_vertices();
  std::vector<double> score(n, 0.0);
  for (const std::uint32_t m : middles) {
    const std::array<SurfaceSearch::Source, 1> source{{{m, 0.0}}};
    search.run(source);
    for (std::size_t v = 0; v < n; ++v) {
      const double d = search.distance(static_cast<SurfaceSearch::Node>(v));
      score[v] += d * d;
    }
  }
  std::vector<SurfaceSearch::Source> rim;
  for (int i = 0; i < static_cast<int>(mesh.n_halfedges()); ++i) {
    const HalfedgeHandle outside(i);
    if (!mesh.is_boundary(outside)) {
      continue;
    }
    const VertexHandle v = mesh.to_vertex_handle(outside);
    const HalfedgeHandle h = mesh.opposite(outside);
    const VertexHandle apex = mesh.to_vertex_handle(mesh.next(h));
    const Vec3d& a = mesh.position(v);
    const Vec3d edge = mesh.position(mesh.to_vertex_handle(h)) - a;
    const Vec3d over = mesh.position(apex) - a;
    const double along = over.dot(edge);
    rim.push_back({search.node(v), 0.0});
    rim.push_back({search.node(mesh.edge_handle(h)), 0.0});
    if (along > 0 && along < edge.squaredNorm()) {
      rim.push_back({search.node(apex), edge.cross(over).norm() / edge.norm()});
    }
  }
  search.run(rim);
  std::size_t best = n;
  double best_score = std::numeric_limits<double>::infinity();
  for (std::size_t v = 0; v < n; ++v) {
    const VertexHandle handle(static_cast<int>(v));
    if (mesh.is_wall(handle)) {
      continue;
    }
    const double depth = search.distance(search.node(handle));
    const double s = score[v] / (depth * depth);
    if (best == n || s < best_score) {  // false if it lies where the rim does
      best = v;
      best_score = std::isnan(s) ? std::numeric_limits<double>::infinity() : s;
    }
  }
  ensure(best < n, "a chart has a vertex inside");
  return VertexHandle(static_cast<int>(best));
}

/// Fills triangle and part_begin: part after part what the walls let be reached.
void collect_parts(const CutMesh& mesh, SplitDisk& out) {
  const std::size_t n = out.spokes.size();
  constexpr std::uint32_t kNone = 0xffffffffU;
  std::vector<std::uint32_t> part(mesh.n_faces(), kNone);
  std::vector<FaceHandle> queue;
  for (std::size_t i = 0; i < n; ++i) {
    const std::vector<std::uint32_t>& before = out.spokes[(i + n - 1) % n];
    queue.assign(1,
                 mesh.face_handle(mesh.find_halfedge(VertexHandle(static_cast<int>(before[0])),
                                                     VertexHandle(static_cast<int>(before[1])))));
    ensure(part[queue[0].idx()] == kNone, "spokes leave the centre in the order of the middles");
    part[queue[0].idx()] = static_cast<std::uint32_t>(i);
    while (!queue.empty()) {
      HalfedgeHandle h = mesh.halfedge_handle(queue.back());
      queue.pop_back();
      for (int k = 0; k < 3; ++k, h = mesh.next(h)) {
        if (mesh.is_wall(mesh.edge_handle(h))) {
          continue;
        }
        const FaceHandle f = mesh.face_handle(mesh.opposite(h));
        if (part[f.idx()] == kNone) {
          part[f.idx()] = static_cast<std::uint32_t>(i);
          queue.push_back(f);
        }
      }
    }
  }
  out.part_begin.assign(n + 1, 0);
  for (const std::uint32_t p : part) {
    ensure(p < n, "every triangle belongs to a part");
    ++out.part_begin[p + 1];
  }
  for (std::size_t i = 0; i < n; ++i) {
    out.part_begin[i + 1] += out.part_begin[i];
  }
  std::vector<std::uint32_t> next(out.part_begin.begin(), out.part_begin.end() - 1);
  out.triangle.resize(part.size());
  for (std::size_t f = 0; f < part.size(); ++f) {
    HalfedgeHandle h = mesh.halfedge_handle(FaceHandle(static_cast<int>(f)));
    auto& t = out.triangle[next[part[f]]++];
    for (std::uint32_t& v : t) {
      v = static_cast<std::uint32_t>(mesh.from_vertex_handle(h).idx());
      h = mesh.next(h);
    }
  }
}

}  // namespace

SplitDisk split_disk(std::span<const Vec3d> position,
                     std::span<const std::array<std::uint32_t, 3>> triangle,
                     std::span<const std::uint32_t> middles) {
  CutMesh mesh(position, triangle);
  check_middles(mesh, middles);
  refine_inside(mesh);
  const VertexHandle centre = find_centre(mesh, middles);
  mesh.make_wall(centre);
  SplitDisk out;
  out.centre = static_cast<std::uint32_t>(centre.idx());
  for (const std::uint32_t m : middles) {
    const auto path = layout::geodesic_path(mesh, centre, VertexHandle(static_cast<int>(m)));
    std::vector<std::uint32_t>& spoke = out.spokes.emplace_back();
    for (const VertexHandle v : layout::cut_along(mesh, path)) {
      spoke.push_back(static_cast<std::uint32_t>(v.idx()));
    }
  }
  collect_parts(mesh, out);
  out.position = mesh.positions();
  out.made = mesh.made();
  return out;
}

}  // namespace rattan
