// SPDX-License-Identifier: MIT
#include "engine/remesh/refine_creases.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "engine/remesh/cell_map.h"
#include "engine/remesh/crease_curve.h"
#include "engine/remesh/repair.h"
#include "engine/remesh/split_cells.h"

namespace rattan {

namespace {

constexpr int kRounds = 3;
/// Edges shorter than this many tolerances stay whole.
constexpr double kShortest = 6.0;

struct Division {
  std::uint32_t u, v;
  Vec3d at;
};

std::vector<Division> find_divisions(const PolygonMesh& mesh, const CreaseCurve& creases,
                                     double tolerance) {
  const CreaseVertices at = crease_vertices(mesh, creases);
  std::vector<Division> out;
  for (const auto& [u, v] : mesh.feature_edges) {
    const Vec3d& p = mesh.positions[u];
    const Vec3d& q = mesh.positions[v];
    const Vec3d middle = 0.5 * (p + q);
    const std::uint32_t curve = at.curve[u] != kNoCurve   ? at.curve[u]
                                : at.curve[v] != kNoCurve ? at.curve[v]
                                                          : creases.nearest_curve(middle);
    const Vec3d on = creases.closest(middle, curve);
    double off = 0.0;
    for (const double t : {0.25, 0.5, 0.75}) {
      const Vec3d x = p + t * (q - p);
      off = std::max(off, (creases.closest(x, curve) - x).norm());
    }
    const double length = (q - p).norm();
    if (off > tolerance && off < 0.5 * length && length > kShortest * tolerance) {
      out.push_back({u, v, on});
    }
  }
  return out;
}

}  // namespace

std::uint64_t refine_creases(PolygonMesh& mesh, const FeatureSet& features, double tolerance) {
  const CreaseCurve creases(&features);
  std::uint64_t added = 0;
  if (creases.empty()) {
    return added;
  }
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<Division> divisions = find_divisions(mesh, creases, tolerance);
    if (divisions.empty()) {
      break;
    }
    CellMap map(std::move(mesh));
    map.set_normals({});
    for (const Division& d : divisions) {
      const std::uint32_t h = map.find_half(d.u, d.v);
      if (h != CellMap::kNone) {
        map.split_edge(h, d.at);
        ++added;
      }
    }
    split_cells(map);
    repair(map);
    mesh = map.to_mesh();
  }
  return added;
}

}  // namespace rattan
