// SPDX-License-Identifier: MIT
#include "engine/remesh/quadrangulate.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "engine/core/errors.h"
#include "engine/layout/disjoint_sets.h"
#include "engine/remesh/balance.h"
#include "engine/remesh/cell_map.h"
#include "engine/remesh/collapse_quads.h"
#include "engine/remesh/edge_sort.h"
#include "engine/remesh/join_triangles.h"
#include "engine/remesh/pair_triangles.h"
#include "engine/remesh/quality.h"
#include "engine/remesh/repair.h"
#include "engine/remesh/split_cells.h"

namespace rattan {
namespace {

std::uint64_t count_triangles(const CellMap& map) {
  std::uint64_t count = 0;
  for (std::uint32_t f = 0; f < map.face_count(); ++f) {
    count += map.is_cell(f) && map.degree(f) == 3;
  }
  return count;
}

/// One a face: 1 if its component holds a triangle.
std::vector<std::uint8_t> in_components_with_triangles(const PolygonMesh& mesh) {
  layout::DisjointSets sets(mesh.vertex_count());
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    for (const std::uint32_t v : mesh.face(f)) {
      sets.unite(mesh.face(f)[0], v);
    }
  }
  std::vector<std::uint8_t> odd(mesh.vertex_count(), 0), chosen(mesh.face_count());
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    if (mesh.degree(f) == 3) {
      odd[sets.find(mesh.face(f)[0])] = 1;
    }
  }
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    chosen[f] = odd[sets.find(mesh.face(f)[0])];
  }
  return chosen;
}

/// One round: divides the quads that are bad now and insets those that this leaves undividable.
std::uint64_t divide_bad_quads(PolygonMesh& mesh, double least) {
  const std::vector<std::uint32_t> bad = quads_not_above(mesh, least);
  if (bad.empty()) {
    return 0;
  }
  CellMap map(std::move(mesh));
  map.set_normals({});
  PolygonSplitter splitter;
  PolygonCorners corners;
  std::vector<std::uint32_t> halves;
  for (const std::uint32_t f : bad) {
    map.face_halves(f, halves);
    double best = 0;
    int choice = -1;
    for (int d = 0; d < 2; ++d) {
      if (map.adjacent(map.origin(halves[d]), map.origin(halves[d + 2]))) {
        continue;
      }
      double cost = 0;
      for (const int start : {d, d + 2}) {
        const std::uint32_t triangle[3] = {halves[start], halves[(start + 1) % 4],
                                           halves[(start + 2) % 4]};
        gather_corners(map, triangle, {}, corners);
        cost += splitter.cost(corners);
      }
      if (choice < 0 || cost < best) {
        choice = d;
        best = cost;
      }
    }
    if (choice < 0) {
      map.star_face(f, halves, map.face_centre(f));
    } else {
      map.split_face(halves[choice], halves[choice + 2]);
    }
  }
  inset_undividable_quads(map);
  mesh = map.to_mesh();
  return bad.size();
}

}  // namespace

PolygonMesh quadrangulate(CellComplex&& cells, const QuadrangulateOptions& options,
                          QuadrangulateReport& report, std::span<const Vec3d> normals) {
  ensure(options.side > 0, "the side of a quad is positive");
  report = {};
  CellMap map(std::move(cells));
  if (!normals.empty()) {
    map.set_normals(normals);
  }
  report.clean = clean(map, options.side, options.contract_below);
  if (normals.empty()) {
    map.set_normals({});
  }
  const SplitReport split = split_cells(map);
  report.stars = split.stars;
  report.insets = split.insets;
  report.triangles_split = count_triangles(map);
  const PairReport paired = pair_triangles(map, options.pair_between);
  report.triangle_pairs = paired.pairs;
  report.border_triangles = paired.at_border;
  if (options.pure_quads) {
    report.collapsed = collapse_irregular(map);
    report.joined = join_triangles(map);
    report.collapsed += collapse_irregular(map);
  }
  const BalanceReport balanced = balance_valences(map);
  report.balanced = balanced.collapsed + balanced.turned;
  const RepairReport repaired = repair(map);
  report.doublets = repaired.doublets;
  report.insets += repaired.insets;
  const bool subdivide = options.pure_quads && count_triangles(map) > 0;
  PolygonMesh mesh = map.to_mesh();
  if (subdivide) {
    const std::vector<std::uint8_t> chosen = in_components_with_triangles(mesh);
    report.subdivided = static_cast<std::uint64_t>(std::count(chosen.begin(), chosen.end(), 1));
    return subdivide_to_quads(std::move(mesh), chosen);
  }
  return mesh;
}

double expected_faces(const CellComplex& cells) {
  std::uint64_t halves = 0;
  for (std::size_t f = 0; f < cells.mesh.face_count(); ++f) {
    const std::uint64_t n = cells.mesh.degree(f);
    halves += n < 3 ? 0 : std::max<std::uint64_t>(n - 2, 2);
  }
  return std::max(1.0, 0.5 * static_cast<double>(halves));
}

PolygonMesh subdivide_to_quads(PolygonMesh&& mesh, std::span<const std::uint8_t> chosen) {
  const bool origins = !mesh.scan_triangle.empty();
  const std::vector<FaceSide> sides = sorted_sides(mesh);
  PolygonMesh fine;
  fine.positions = std::move(mesh.positions);
  fine.scan_triangle = std::move(mesh.scan_triangle);
  fine.vertex_flags = std::move(mesh.vertex_flags);
  fine.vertex_flags.resize(fine.positions.size(), 0);
  const auto add = [&](const Vec3d& p, std::uint32_t source, std::uint8_t flags) {
    fine.positions.push_back(p);
    fine.vertex_flags.push_back(flags);
    if (origins) {
      fine.scan_triangle.push_back(std::uint64_t{fine.scan_triangle[source]});
    }
    return static_cast<std::uint32_t>(fine.positions.size() - 1);
  };
  std::vector<std::array<std::uint32_t, 2>> features = std::move(mesh.feature_edges);
  std::sort(features.begin(), features.end());
  std::vector<std::uint32_t> middle(mesh.corners.size());
  for (std::size_t i = 0; i < sides.size();) {
    const FaceSide& a = sides[i];
    std::size_t j = i + 1;
    while (j < sides.size() && sides[j].low == a.low && sides[j].high == a.high) {
      ++j;
    }
    if (!chosen.empty() && chosen[a.face] == 0) {
      i = j;
      continue;
    }
    const Vec3d p = 0.5 * (fine.positions[a.low] + fine.positions[a.high]);
    const bool feature =
        std::binary_search(features.begin(), features.end(), std::array{a.low, a.high});
    const std::uint32_t v =
        add(p, a.low, j - i == 1 ? kBoundaryVertex : (feature ? kFeatureVertex : std::uint8_t{0}));
    if (feature) {
      fine.feature_edges.push_back({a.low, v});
      fine.feature_edges.push_back({a.high, v});
    }
    for (; i < j; ++i) {
      middle[sides[i].corner] = v;
    }
  }
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    if (!chosen.empty() && chosen[f] == 0) {
      fine.add_face(mesh.face(f));
      continue;
    }
    const std::size_t begin = mesh.face_begin[f], n = mesh.degree(f);
    Vec3d centre = Vec3d::Zero();
    for (const std::uint32_t v : mesh.face(f)) {
      centre += fine.positions[v];
    }
    const std::uint32_t c = add(Vec3d(centre / static_cast<double>(n)), mesh.corners[begin], 0);
    for (std::size_t k = 0; k < n; ++k) {
      const std::uint32_t quad[4] = {mesh.corners[begin + k], middle[begin + k], c,
                                     middle[begin + (k + n - 1) % n]};
      fine.add_face(quad);
    }
  }
  return fine;
}

std::uint64_t split_bad_quads(PolygonMesh& mesh, double least) {
  std::uint64_t divided = 0;
  // A new diagonal can leave another quad undividable, and its inset can hold a bad quad; but no
  // quad is inset twice, and what is inset has only fresh vertices, so this ends.
  while (const std::uint64_t now = divide_bad_quads(mesh, least)) {
    divided += now;
  }
  return divided;
}

}  // namespace rattan
