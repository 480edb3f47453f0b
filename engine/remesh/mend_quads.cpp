// SPDX-License-Identifier: MIT
#include "engine/remesh/mend_quads.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "engine/remesh/cell_map.h"
#include "engine/remesh/collapse_quads.h"
#include "engine/remesh/quality.h"
#include "engine/remesh/repair.h"

namespace rattan {
namespace {

/// Valence beyond which a merged vertex would be worse than an inset.
constexpr std::uint32_t kMostValence = 6;
constexpr std::size_t kMostMends = 5;
constexpr std::array<double, 4> kLeashes{0.0, 100.0, 10.0, 1.0};
/// How many of them are tried, by the number of times that quads were changed.
constexpr std::array<std::size_t, kMostMends + 1> kTries{1, 2, 4, 4, 4, 4};

/// The least scaled Jacobian of the other quads around a and c if both were at `p`.
double least_after(const CellMap& map, std::uint32_t quad, std::uint32_t a, std::uint32_t c,
                   const Vec3d& p) {
  double least = 1.0;
  for (const std::uint32_t v : {a, c}) {
    const std::uint32_t start = map.vertex_half(v);
    std::uint32_t out = start;
    do {
      const std::uint32_t f = map.face(out);
      if (f != quad && map.is_cell(f) && map.degree(f) == 4) {
        std::array<Vec3d, 4> x;
        std::uint32_t h = out;
        for (Vec3d& corner : x) {
          const std::uint32_t w = map.origin(h);
          corner = w == a || w == c ? p : map.position(w);
          h = map.next(h);
        }
        least = std::min(least, scaled_jacobian(x[0], x[1], x[2], x[3]));
      }
      out = map.around(out);
    } while (out != start);
  }
  return least;
}

/// Collapses the quad the better way if that is allowed and leaves good faces.
bool try_collapse(CellMap& map, std::uint32_t f, double least) {
  const std::uint32_t first = map.face_half(f);
  double best = least;
  std::uint32_t best_half = CellMap::kNone;
  for (const std::uint32_t h : {first, map.next(first)}) {
    const std::uint32_t a = map.origin(h), c = map.target(map.next(h));
    if (map.valence(a) + map.valence(c) - 2 > kMostValence || !collapsible(map, h)) {
      continue;
    }
    const double after = least_after(map, f, a, c, collapsed_position(map, h));
    if (after > best) {
      best = after;
      best_half = h;
    }
  }
  if (best_half == CellMap::kNone) {
    return false;
  }
  collapse_quad(map, best_half);
  return true;
}

}  // namespace

MendReport mend_bad_quads(PolygonMesh& mesh, double least) {
  MendReport report;
  const std::vector<std::uint32_t> bad = quads_not_above(mesh, least);
  if (bad.empty()) {
    return report;
  }
  CellMap map(std::move(mesh));
  map.set_normals({});
  for (const std::uint32_t f : bad) {
    if (!map.is_cell(f)) {
      continue;
    }
    if (try_collapse(map, f, least)) {
      ++report.collapsed;
    } else {
      map.inset_face(f);
      ++report.inset;
    }
  }
  // Collapses may leave quads on the same vertices.
  repair(map);
  mesh = map.to_mesh();
  return report;
}

std::uint64_t mend_until_good(PolygonMesh& mesh, SurfaceProjector& projector,
                              const UntangleOptions& options, TaskGraph& graph,
                              const std::function<bool(std::size_t)>& acceptable) {
  std::uint64_t fewest = quads_not_above(mesh, options.least).size();
  if (fewest == 0) {
    return fewest;
  }
  PolygonMesh first = mesh;
  PolygonMesh mended = mesh;
  for (std::size_t mends = 0; mends <= kMostMends; ++mends) {
    if (mends > 0) {
      mend_bad_quads(mended, options.least);
    }
    for (std::size_t k = 0; k < kTries[mends]; ++k) {
      UntangleOptions leashed = options;
      leashed.leash = kLeashes[k];
      const std::uint64_t left = untangle(mended, projector, leashed, graph).bad_after;
      if (left < fewest && acceptable(mended.face_count())) {
        fewest = left;
        mesh = mended;
      }
      if (left == 0) {
        return fewest;
      }
    }
  }
  UntangleOptions last = options;
  last.leash = kLeashes.back();
  last.any_way = true;
  for (PolygonMesh* tried : {&first, &mesh}) {
    mended = *tried;
    const std::uint64_t left = untangle(mended, projector, last, graph).bad_after;
    if (left < fewest) {
      fewest = left;
      mesh = mended;
    }
  }
  return fewest;
}

}  // namespace rattan
