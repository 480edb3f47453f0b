// SPDX-License-Identifier: MIT
//
// Directions that come with the scan are followed.
#include <algorithm>
#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "engine/mesh/ingest.h"
#include "engine/param/parameterize.h"
#include "tests/engine/mesh/test_surfaces.h"

namespace rattan {
namespace {

using testing::Surface;

/// Degrees modulo a quarter turn between the field and what `wanted` says, largest over the
/// vertices for which it says something.
double largest_deviation(const Surface& s,
                         const std::function<VertexDirection(const Vec3d&)>& given,
                         const std::function<Vec3d(const Vec3d&)>& wanted) {
  MemoryStore store;
  TaskGraph tasks({.threads = 2});
  Ingest in(store, {.tile_size = 500});
  in.add_vertices(s.positions);
  std::vector<VertexDirection> directions;
  for (const Vec3d& p : s.positions) {
    directions.push_back(given(p));
  }
  in.add_directions(directions);
  std::vector<std::array<std::uint64_t, 3>> triangles;
  for (const auto& t : s.triangles) {
    triangles.push_back({t[0], t[1], t[2]});
  }
  in.add_triangles(triangles);
  const ScanMesh mesh = in.finish(tasks);
  FieldOptions options;
  // Directions reach over three edges.
  options.quad_side = mesh.mean_edge_length;
  compute_field(store, mesh, options, tasks);
  double largest = 0.0;
  for (std::uint32_t t = 0; t < mesh.layout.tile_count(); ++t) {
    const auto frames = read(store, fields::kFrame, TileId(t));
    for (std::uint32_t v = 0; v < mesh.layout.tiles[t].owned; ++v) {
      const VertexFrame& f = frames[v];
      const Vec3d n = f.normal.cast<double>();
      Vec3d w = wanted(f.position.cast<double>());
      w -= w.dot(n) * n;
      if (w.norm() == 0.0) {
        continue;
      }
      const double x = std::abs(w.dot(f.direction.cast<double>()));
      const double y = std::abs(w.dot(n.cross(f.direction.cast<double>())));
      largest = std::max(largest, std::atan2(std::min(x, y), std::max(x, y)) * 180.0 / M_PI);
    }
  }
  return largest;
}

TEST(WantedField, ConstantOnAPlane) {
  const Surface s = testing::plane(40, 30, 4.0, 3.0);
  const Vec3d along(std::cos(0.4), std::sin(0.4), 0.0);
  const auto wanted = [&](const Vec3d&) { return along; };
  // The boundary follows, too, and what stands off the plane counts by its part in it.
  EXPECT_LT(largest_deviation(
                s,
                [&](const Vec3d&) {
                  return VertexDirection{(along + Vec3d(0, 0, 0.5)).cast<float>(), 1.0F};
                },
                wanted),
            0.5);
  // Some vertices speak, the others have no opinion; the boundary alone would be 23 degrees off.
  EXPECT_LT(largest_deviation(
                s,
                [&](const Vec3d& p) {
                  const bool inside = (p - Vec3d(2, 1.5, 0)).norm() < 1.0;
                  return VertexDirection{(inside ? along : Vec3d::Zero()).eval().cast<float>(),
                                         inside ? 1.0F : 0.5F};
                },
                [&](const Vec3d& p) {
                  return (p - Vec3d(2, 1.5, 0)).norm() < 0.4 ? along : Vec3d::Zero().eval();
                }),
            10.0);
}

TEST(WantedField, LatitudesOfASphere) {
  const Surface s = testing::sphere(24, 1.0);
  const auto east = [](const Vec3d& p) { return Vec3d(-p.y(), p.x(), 0.0); };
  const double off = largest_deviation(
      s,
      [&](const Vec3d& p) {
        return VertexDirection{east(p).cast<float>(), 1.0F};
      },
      [&](const Vec3d& p) { return std::abs(p.z()) < 0.5 ? east(p) : Vec3d::Zero().eval(); });
  EXPECT_LT(off, 2.0);
}

TEST(WantedField, NoFidelityLeavesNoOpinion) {
  // With a fidelity of zero a vector is as good as none: two fields in conflict, one without
  // weight.
  const Surface s = testing::plane(40, 40, 4.0, 4.0);
  const Vec3d along(std::cos(0.3), std::sin(0.3), 0.0);
  const Vec3d across(std::cos(1.1), std::sin(1.1), 0.0);
  std::uint32_t count = 0;
  const double off = largest_deviation(
      s,
      [&](const Vec3d&) {
        return ++count % 2 == 0 ? VertexDirection{along.cast<float>(), 1.0F}
                                : VertexDirection{across.cast<float>(), 0.0F};
      },
      [&](const Vec3d& p) {
        const bool inner = (p - Vec3d(2, 2, 0)).cwiseAbs().maxCoeff() < 0.3;
        return inner ? along : Vec3d::Zero().eval();
      });
  EXPECT_LT(off, 5.0);
}

}  // namespace
}  // namespace rattan
