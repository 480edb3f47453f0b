// SPDX-License-Identifier: MIT
#include "engine/remesh/vertex_stars.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "engine/core/errors.h"
#include "engine/core/parallel.h"

namespace rattan {

namespace {

Vec3d area_normal(std::span<const Vec3d> x, std::span<const std::uint32_t> face) {
  if (face.size() == 4) {
    return (x[face[2]] - x[face[0]]).cross(x[face[3]] - x[face[1]]);
  }
  Vec3d n = Vec3d::Zero();
  for (std::size_t k = 1; k + 1 < face.size(); ++k) {
    n += (x[face[k]] - x[face[0]]).cross(x[face[k + 1]] - x[face[0]]);
  }
  return n;
}

}  // namespace

VertexStars::VertexStars(const PolygonMesh& mesh) {
  ensure(mesh.corners.size() < kNoVertex, "remesh corners are numbered in 32 bits");
  const std::size_t n = mesh.vertex_count();
  begin.assign(n + 1, 0);
  for (const std::uint32_t v : mesh.corners) {
    ++begin[v + 1];
  }
  for (std::size_t v = 0; v < n; ++v) {
    begin[v + 1] += begin[v];
  }
  corner.resize(mesh.corners.size());
  face.resize(mesh.corners.size());
  std::vector<std::uint32_t> fill(begin.begin(), begin.end() - 1);
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    for (std::uint64_t c = mesh.face_begin[f]; c < mesh.face_begin[f + 1]; ++c) {
      const std::uint32_t at = fill[mesh.corners[c]]++;
      corner[at] = static_cast<std::uint32_t>(c);
      face[at] = static_cast<std::uint32_t>(f);
    }
  }

  boundary.assign(n, {kNoVertex, kNoVertex});
  on_boundary.assign(n, 0);
  parallel_indices(n, [&](std::size_t v) {
    // The edge v -> next of one corner is the edge prev -> v of another, unless it bounds one face.
    std::uint32_t in = kNoVertex;
    std::uint32_t out = kNoVertex;
    std::uint32_t ins = 0;
    std::uint32_t outs = 0;
    const auto next_of = [&](std::uint32_t at) {
      const std::uint64_t first = mesh.face_begin[face[at]];
      const std::uint64_t d = mesh.face_begin[face[at] + 1] - first;
      return mesh.corners[first + (corner[at] - first + 1) % d];
    };
    const auto previous_of = [&](std::uint32_t at) {
      const std::uint64_t first = mesh.face_begin[face[at]];
      const std::uint64_t d = mesh.face_begin[face[at] + 1] - first;
      return mesh.corners[first + (corner[at] - first + d - 1) % d];
    };
    for (std::uint32_t a = begin[v]; a < begin[v + 1]; ++a) {
      bool next_shared = false;
      bool previous_shared = false;
      for (std::uint32_t b = begin[v]; b < begin[v + 1]; ++b) {
        next_shared = next_shared || next_of(a) == previous_of(b);
        previous_shared = previous_shared || previous_of(a) == next_of(b);
      }
      if (!next_shared) {
        out = next_of(a);
        ++outs;
      }
      if (!previous_shared) {
        in = previous_of(a);
        ++ins;
      }
    }
    on_boundary[v] = ins + outs > 0 ? 1 : 0;
    if (ins == 1 && outs == 1) {
      boundary[v] = {in, out};
    }
  });
}

double corner_quality(std::span<const Vec3d> positions, std::span<const std::uint32_t> face,
                      const Vec3d& reference) {
  Vec3d n = area_normal(positions, face);
  const double length = n.norm();
  if (!(length > 0.0)) {
    return -1.0;
  }
  n /= length;
  const std::size_t d = face.size();
  double least = 1.0;
  for (std::size_t k = 0; k < d; ++k) {
    const Vec3d& p = positions[face[k]];
    const Vec3d e = positions[face[k + 1 == d ? 0 : k + 1]] - p;
    const Vec3d f = positions[face[k == 0 ? d - 1 : k - 1]] - p;
    const double lengths = std::sqrt(e.squaredNorm() * f.squaredNorm());
    if (!(lengths > 0.0)) {
      return -1.0;
    }
    least = std::min(least, e.cross(f).dot(n) / lengths);
  }
  return n.dot(reference) < 0.0 ? least - kFacingAway : least;
}

std::vector<Vec3d> vertex_normals(const PolygonMesh& mesh, const VertexStars& stars) {
  std::vector<Vec3d> faces(mesh.face_count());
  parallel_indices(mesh.face_count(),
                   [&](std::size_t f) { faces[f] = area_normal(mesh.positions, mesh.face(f)); });
  std::vector<Vec3d> normals(mesh.vertex_count());
  parallel_indices(mesh.vertex_count(), [&](std::size_t v) {
    Vec3d n = Vec3d::Zero();
    for (const std::uint32_t f : stars.faces(static_cast<std::uint32_t>(v))) {
      n += faces[f];
    }
    const double length = n.norm();
    normals[v] = length > 0.0 ? Vec3d(n / length) : Vec3d::UnitZ();
  });
  return normals;
}

double mean_edge_length(const PolygonMesh& mesh) {
  if (mesh.corners.empty()) {
    return 0.0;
  }
  const double sum = parallel_sum(mesh.face_count(), 0.0, [&](std::size_t first, std::size_t last) {
    double part = 0.0;
    for (std::size_t f = first; f < last; ++f) {
      const auto face = mesh.face(f);
      for (std::size_t k = 0; k < face.size(); ++k) {
        part += (mesh.positions[face[k]] - mesh.positions[face[(k + 1) % face.size()]]).norm();
      }
    }
    return part;
  });
  return sum / static_cast<double>(mesh.corners.size());
}

}  // namespace rattan
