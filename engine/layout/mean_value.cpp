// SPDX-License-Identifier: MIT
// Based on M. Floater, "Mean value coordinates", 2003; S. Yoshizawa, A. Belyaev, H.-P. Seidel, "A
// fast and simple stretch-minimizing mesh parameterization", 2004.
#include "engine/layout/mean_value.h"

#include "engine/core/errors.h"

namespace rattan::layout {
namespace {

constexpr std::uint32_t kNoRow = 0xffffffffU;
/// Bounds of tan(angle / 2) and, in parts of the longest edge around a vertex, of lengths.
constexpr double kLeastTangent = 1e-3;
constexpr double kMostTangent = 1e2;
constexpr double kLeastLength = 1e-3;
/// The least weight of a neighbour; the sum is 1.
constexpr double kLeastWeight = 1e-5;
/// Flat areas below count as this, in parts of the square's: what coordinates can still tell.
constexpr double kLeastArea = 1e-24;
/// What each triangle weighs in the stretch around a vertex at least, in parts of the mean area.
constexpr double kLeastShare = 1e-6;

/// Mean square of the singular values of the way from a flat triangle to one of the surface, whose
/// area is given.
double squared_stretch(const FlatDisk& disk, const std::array<std::uint32_t, 3>& c, double area) {
  const Vec2d& p0 = disk.uv[c[0]];
  const Vec2d& p1 = disk.uv[c[1]];
  const Vec2d& p2 = disk.uv[c[2]];
  const Vec3d e1 = disk.position[c[1]] - disk.position[c[0]];
  const Vec3d e2 = disk.position[c[2]] - disk.position[c[0]];
  const double flat = std::max(doubled_area(p0, p1, p2), kLeastArea * disk.size * disk.size);
  const Vec3d du = e1 * (p2.y() - p0.y()) + e2 * (p0.y() - p1.y());
  const Vec3d dv = e1 * (p0.x() - p2.x()) + e2 * (p1.x() - p0.x());
  // Never below the ratio of areas; the formula may be, with the flat area not what it should be.
  return std::max(0.5 * (du.squaredNorm() + dv.squaredNorm()) / (flat * flat), 2 * area / flat);
}

/// Likewise to an equilateral triangle of side 1.
double squared_stretch_equilateral(const FlatDisk& disk, const std::array<std::uint32_t, 3>& c) {
  const Vec2d& p0 = disk.uv[c[0]];
  const Vec2d& p1 = disk.uv[c[1]];
  const Vec2d& p2 = disk.uv[c[2]];
  const double flat = std::max(doubled_area(p0, p1, p2), kLeastArea * disk.size * disk.size);
  const double sides = (p1 - p0).squaredNorm() + (p2 - p1).squaredNorm() + (p0 - p2).squaredNorm();
  return std::max(0.25 * sides / (flat * flat), 0.5 * std::sqrt(3.0) / flat);
}

double area_of(const FlatDisk& disk, const std::array<std::uint32_t, 3>& c) {
  const Vec3d& q = disk.position[c[0]];
  return 0.5 * (disk.position[c[1]] - q).cross(disk.position[c[2]] - q).norm();
}

}  // namespace

double half_tangent(const Vec3d& a, const Vec3d& b) {
  const double across = a.cross(b).norm();
  const double along = a.norm() * b.norm() + a.dot(b);
  if (!(along > 0)) {
    return across > 0 ? kMostTangent : 1.0;
  }
  return std::clamp(across / along, kLeastTangent, kMostTangent);
}

double relative_length(const Vec3d& edge, double longest) {
  return longest > 0 ? std::max(edge.norm() / longest, kLeastLength) : 1.0;
}

double mean_stretch(const FlatDisk& disk) {
  double sum = 0;
  double whole = 0;
  for (const auto& t : disk.triangle) {
    const double area = area_of(disk, t);
    sum += area * squared_stretch(disk, t, area);
    whole += area;
  }
  return whole > 0 ? std::sqrt(sum / whole) : 0;
}

ConvexMap::ConvexMap(const FlatDisk& disk) {
  row_of_.assign(disk.position.size(), kNoRow);
  for (std::uint32_t v = 0; v < disk.position.size(); ++v) {
    if (disk.fixed[v] == 0) {
      row_of_[v] = static_cast<std::uint32_t>(vertex_.size());
      vertex_.push_back(v);
    }
  }
  const std::size_t rows = vertex_.size();
  // Around an inside vertex there are as many neighbours as triangles, one following each side.
  begin_.assign(rows + 1, 0);
  for (const auto& t : disk.triangle) {
    for (const std::uint32_t v : t) {
      if (row_of_[v] != kNoRow) {
        ++begin_[row_of_[v] + 1];
      }
    }
  }
  for (std::size_t r = 0; r < rows; ++r) {
    begin_[r + 1] += begin_[r];
  }
  neighbour_.resize(begin_[rows]);
  std::vector<std::uint32_t> filled(begin_.begin(), begin_.end() - 1);
  std::vector<double> longest(rows, 0.0);
  for (const auto& t : disk.triangle) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t r = row_of_[t[k]];
      if (r != kNoRow) {
        const std::uint32_t to = t[(k + 1) % 3];
        neighbour_[filled[r]++] = to;
        longest[r] = std::max(longest[r], (disk.position[to] - disk.position[t[k]]).norm());
      }
    }
  }
  weight_.assign(neighbour_.size(), 0.0);
  for (const auto& t : disk.triangle) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t r = row_of_[t[k]];
      if (r == kNoRow) {
        continue;
      }
      const std::array<std::uint32_t, 2> to{t[(k + 1) % 3], t[(k + 2) % 3]};
      const std::array<Vec3d, 2> edge{disk.position[to[0]] - disk.position[t[k]],
                                      disk.position[to[1]] - disk.position[t[k]]};
      const double tangent = half_tangent(edge[0], edge[1]);
      for (int e = 0; e < 2; ++e) {
        std::uint32_t i = begin_[r];
        while (i < begin_[r + 1] && neighbour_[i] != to[e]) {
          ++i;
        }
        ensure(i < begin_[r + 1], "Triangles close around an inside vertex");
        weight_[i] += tangent / relative_length(edge[e], longest[r]);
      }
    }
  }
  scale_rows();
  if (rows == 0) {
    return;
  }
  std::vector<std::uint32_t> inside_begin{0};
  std::vector<std::uint32_t> inside_neighbour;
  for (std::uint32_t r = 0; r < rows; ++r) {
    for (std::uint32_t i = begin_[r]; i < begin_[r + 1]; ++i) {
      if (row_of_[neighbour_[i]] != kNoRow) {
        inside_.push_back(i);
        inside_neighbour.push_back(row_of_[neighbour_[i]]);
      }
    }
    inside_begin.push_back(static_cast<std::uint32_t>(inside_.size()));
  }
  elimination_ = Elimination(inside_begin, inside_neighbour);
  found_.resize(rows);
}

void ConvexMap::use_equal_weights() {
  std::fill(weight_.begin(), weight_.end(), 1.0);
  scale_rows();
}

void ConvexMap::scale_rows() {
  for (std::size_t r = 0; r + 1 < begin_.size(); ++r) {
    double sum = 0;
    for (std::uint32_t i = begin_[r]; i < begin_[r + 1]; ++i) {
      sum += weight_[i];
    }
    double floored = 0;
    for (std::uint32_t i = begin_[r]; i < begin_[r + 1]; ++i) {
      weight_[i] = std::max(weight_[i] / sum, kLeastWeight);
      floored += weight_[i];
    }
    for (std::uint32_t i = begin_[r]; i < begin_[r + 1]; ++i) {
      weight_[i] /= floored;
    }
  }
}

void ConvexMap::reweight(const FlatDisk& disk, Reference reference) {
  const std::size_t n = disk.triangle.size();
  std::vector<double> area(n, 1.0);
  if (reference == Reference::kSurface) {
    double whole = 0;
    for (std::size_t t = 0; t < n; ++t) {
      area[t] = area_of(disk, disk.triangle[t]);
      whole += area[t];
    }
    const double least = whole > 0 ? kLeastShare * whole / static_cast<double>(n) : 1.0;
    for (double& a : area) {
      a = std::max(a, least);
    }
  }
  std::vector<double> sum(disk.position.size(), 0.0);
  std::vector<double> around(disk.position.size(), 0.0);
  for (std::size_t t = 0; t < n; ++t) {
    const std::array<std::uint32_t, 3>& c = disk.triangle[t];
    const double square = reference == Reference::kSurface ? squared_stretch(disk, c, area[t])
                                                           : squared_stretch_equilateral(disk, c);
    for (const std::uint32_t v : c) {
      sum[v] += area[t] * square;
      around[v] += area[t];
    }
  }
  for (std::size_t v = 0; v < sum.size(); ++v) {
    sum[v] = std::sqrt(around[v] / sum[v]);
  }
  for (std::size_t i = 0; i < weight_.size(); ++i) {
    weight_[i] *= sum[neighbour_[i]];
  }
  scale_rows();
}

bool ConvexMap::solve(std::span<Vec2d> value) {
  const std::size_t rows = vertex_.size();
  if (rows == 0) {
    return true;
  }
  elimination_.clear();
  for (std::size_t e = 0; e < inside_.size(); ++e) {
    elimination_.set_weight(e, weight_[inside_[e]]);
  }
  for (std::uint32_t r = 0; r < rows; ++r) {
    double weight = 0;
    Vec2d sum = Vec2d::Zero();
    for (std::uint32_t i = begin_[r]; i < begin_[r + 1]; ++i) {
      if (row_of_[neighbour_[i]] == kNoRow) {
        weight += weight_[i];
        sum += weight_[i] * value[neighbour_[i]];
      }
    }
    elimination_.set_fixed(r, weight, sum);
  }
  if (!elimination_.solve(found_)) {
    return false;
  }
  for (std::uint32_t r = 0; r < rows; ++r) {
    value[vertex_[r]] = found_[r];
  }
  return true;
}

}  // namespace rattan::layout
