// SPDX-License-Identifier: MIT
#include "engine/remesh/quality.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Geometry>

#include "engine/core/exact_math.h"
#include "engine/core/parallel.h"
#include "engine/remesh/edge_sort.h"

namespace rattan {
namespace {

struct FaceSums {
  double jacobian = 0, deviation = 0, least = 2;
  double area = 0, squares = 0, shear = 0;
  std::uint64_t quads = 0, triangles = 0, bad = 0;
  FaceSums& operator+=(const FaceSums& o) {
    jacobian += o.jacobian;
    deviation += o.deviation;
    area += o.area;
    squares += o.squares;
    shear += o.shear;
    least = std::min(least, o.least);
    quads += o.quads;
    triangles += o.triangles;
    bad += o.bad;
    return *this;
  }
};

}  // namespace

double scaled_jacobian(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
  const Vec3d normal = (c - a).cross(d - b);
  const double size = normal.norm();
  const Vec3d sides[4] = {b - a, c - b, d - c, a - d};
  const double lengths[4] = {sides[0].norm(), sides[1].norm(), sides[2].norm(), sides[3].norm()};
  double least = 1;
  for (int k = 0; k < 4; ++k) {
    const int p = (k + 3) & 3;
    const double scale = size * lengths[k] * lengths[p];
    const double value = scale > 0 ? normal.dot(sides[p].cross(sides[k])) / scale : 0.0;
    least = std::min(least, value);
  }
  return least;
}

std::vector<std::uint32_t> quads_not_above(const PolygonMesh& mesh, double least) {
  std::vector<std::uint32_t> found;
  for (std::uint32_t f = 0; f < mesh.face_count(); ++f) {
    const auto v = mesh.face(f);
    if (v.size() == 4 && !(scaled_jacobian(mesh.positions[v[0]], mesh.positions[v[1]],
                                           mesh.positions[v[2]], mesh.positions[v[3]]) > least)) {
      found.push_back(f);
    }
  }
  return found;
}

MeshQuality measure_quality(const PolygonMesh& mesh) {
  MeshQuality q;
  const FaceSums sums =
      parallel_sum(mesh.face_count(), FaceSums{}, [&](std::size_t begin, std::size_t end) {
        FaceSums s;
        for (std::size_t f = begin; f < end; ++f) {
          const auto v = mesh.face(f);
          s.triangles += v.size() == 3;
          if (v.size() != 4) {
            continue;
          }
          ++s.quads;
          const Vec3d p[4] = {mesh.positions[v[0]], mesh.positions[v[1]], mesh.positions[v[2]],
                              mesh.positions[v[3]]};
          const double jacobian = scaled_jacobian(p[0], p[1], p[2], p[3]);
          s.jacobian += jacobian;
          s.least = std::min(s.least, jacobian);
          s.bad += !(jacobian > 0);
          const Vec3d along = 0.5 * (p[1] - p[0] + p[2] - p[3]);
          const Vec3d across = 0.5 * (p[3] - p[0] + p[2] - p[1]);
          const double area = along.cross(across).norm();
          const double lengths = along.norm() * across.norm();
          s.area += area;
          // Half the sum of the squared singular values, weighted with area.
          s.squares += 0.5 * (along.squaredNorm() + across.squaredNorm()) * area;
          s.shear += lengths > 0 ? std::abs(along.dot(across)) / lengths : 0.0;
          for (int k = 0; k < 4; ++k) {
            const Vec3d to = p[(k + 1) & 3] - p[k], from = p[(k + 3) & 3] - p[k];
            const double angle = exact::atan2(to.cross(from).norm(), to.dot(from));
            s.deviation += std::abs(angle - exact::kPi / 2);
          }
        }
        return s;
      });
  q.quads = sums.quads;
  q.triangles = sums.triangles;
  q.bad_quads = sums.bad;
  if (mesh.face_count() > 0) {
    q.quad_share = static_cast<double>(q.quads) / static_cast<double>(mesh.face_count());
  }
  if (q.quads > 0) {
    const double count = static_cast<double>(q.quads);
    q.mean_scaled_jacobian = sums.jacobian / count;
    q.min_scaled_jacobian = sums.least;
    q.stretch = sums.area > 0 ? std::sqrt(sums.squares * count) / sums.area : 0.0;
    q.shear = sums.shear / count;
    q.mean_corner_deviation = sums.deviation / (4 * count) * 180 / exact::kPi;
  }

  const std::vector<FaceSide> sides = sorted_sides(mesh);
  std::vector<std::uint32_t> valence(mesh.vertex_count(), 0);
  std::vector<std::uint8_t> border(mesh.vertex_count(), 0);
  double sum = 0, squares = 0;
  std::uint64_t edges = 0;
  for (std::size_t i = 0; i < sides.size();) {
    const FaceSide& a = sides[i];
    std::size_t j = i + 1;
    while (j < sides.size() && sides[j].low == a.low && sides[j].high == a.high) {
      ++j;
    }
    ++valence[a.low];
    ++valence[a.high];
    if (j - i == 1) {
      border[a.low] = border[a.high] = 1;
    }
    const double square = (mesh.positions[a.low] - mesh.positions[a.high]).squaredNorm();
    sum += std::sqrt(square);
    squares += square;
    ++edges;
    i = j;
  }
  for (std::size_t v = 0; v < valence.size(); ++v) {
    if (valence[v] > 0 && !border[v]) {
      ++q.interior_vertices;
      q.irregular_vertices += valence[v] != 4;
    }
  }
  if (edges > 0 && sum > 0) {
    q.mean_edge_length = sum / static_cast<double>(edges);
    const double variance =
        squares / static_cast<double>(edges) - q.mean_edge_length * q.mean_edge_length;
    q.edge_length_variation = std::sqrt(std::max(variance, 0.0)) / q.mean_edge_length;
  }
  return q;
}

}  // namespace rattan
