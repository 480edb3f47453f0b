// SPDX-License-Identifier: MIT
#include "io/synth/patches.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "engine/core/errors.h"
#include "engine/core/exact_math.h"

namespace rattan::synth {
namespace {

using exact::kPi;

// The plate: cells 2 wide, half-thickness, tunnel radius, and how far the rounding reaches.
constexpr double kHalfThickness = 0.42;
constexpr double kTunnelRadius = 0.42;
constexpr double kTunnelRounding = 0.38;
constexpr double kRimRounding = 0.45;
// Share of a tunnel sector's grid that lies on the rounding.
constexpr double kRoundedShare = 0.62;
// Share of the triangles that the grids give; the rest comes from quads with a centre.
constexpr double kGridShare = 0.86;

Vec3d turned(const Vec3d& p, int quarters) {
  switch (quarters & 3) {
    case 0:
      return p;
    case 1:
      return {-p.y(), p.x(), p.z()};
    case 2:
      return {-p.x(), -p.y(), p.z()};
    default:
      return {p.y(), -p.x(), p.z()};
  }
}

double tangent(double s) {
  const exact::SinCos a = exact::sincos((s - 0.5) * (kPi / 2));
  return a.sin / a.cos;
}

BasePoint cube_face(int face, double u, double v) {
  Vec3d p(1.0, tangent(u), tangent(v));
  p /= std::sqrt(p.squaredNorm());
  const int axis = face / 2;
  Vec3d q;
  for (int k = 0; k < 3; ++k) {
    q[(k + axis) % 3] = p[k];
  }
  if (face % 2 == 1) {
    // The opposite face: mirrored twice, so that u cross v still points outwards.
    q[axis] = -q[axis];
    q[(axis + 1) % 3] = -q[(axis + 1) % 3];
  }
  return {q, q};
}

// x outwards from the cell's centre, y along its side; u is radial, v runs along the side.
BasePoint tunnel_sector(double u, double v) {
  const exact::SinCos angle = exact::sincos((v - 0.5) * (kPi / 2));
  double radius = 0.0;
  double z = kHalfThickness;
  double along = 0.0;
  double up = 1.0;
  if (u < kRoundedShare) {
    const exact::SinCos a = exact::sincos(u / kRoundedShare * (kPi / 2));
    radius = kTunnelRadius + kTunnelRounding * (1.0 - a.cos);
    z = kHalfThickness * a.sin;
    along = -kHalfThickness * a.cos;
    up = kTunnelRounding * a.sin;
    const double length = std::sqrt(along * along + up * up);
    along /= length;
    up /= length;
  } else {
    const double f = (u - kRoundedShare) / (1.0 - kRoundedShare);
    radius = (kTunnelRadius + kTunnelRounding) * (1.0 - f) + f / angle.cos;
  }
  return {{radius * angle.cos, radius * angle.sin, z}, {along * angle.cos, along * angle.sin, up}};
}

// The quarter ellipse at distance `out` in [0, 1] along the direction (dx, dy) in the plane.
BasePoint rounded(const Vec3d& from, double dx, double dy, double out) {
  const exact::SinCos a = exact::sincos(out * (kPi / 2));
  double along = kHalfThickness * a.sin;
  double up = kRimRounding * a.cos;
  const double length = std::sqrt(along * along + up * up);
  along /= length;
  up /= length;
  return {
      from + Vec3d(kRimRounding * a.sin * dx, kRimRounding * a.sin * dy, kHalfThickness * a.cos),
      {along * dx, along * dy, up}};
}

// A square mapped smoothly onto a quarter disk: its two outer sides become the arc.
BasePoint plate_corner(double u, double v) {
  const double x = u * std::sqrt(1.0 - 0.5 * v * v);
  const double y = v * std::sqrt(1.0 - 0.5 * u * u);
  const double out = std::sqrt(x * x + y * y);
  const double scale = out > 0.0 ? 1.0 / out : 0.0;
  return rounded({1.0, 1.0, 0.0}, x * scale, y * scale, std::min(out, 1.0));
}

std::array<double, 2> corner_parameters(int corner) {
  static constexpr double kU[] = {0, 1, 1, 0};
  static constexpr double kV[] = {0, 0, 1, 1};
  return {kU[corner], kV[corner]};
}

std::uint32_t side_segments(const Patch& patch, int side) {
  return side % 2 == 0 ? patch.nu : patch.nv;
}

// Corners that coincide in space are the same; all others are at least a tenth apart.
std::array<std::int64_t, 3> corner_key(const Vec3d& p) {
  std::array<std::int64_t, 3> key{};
  for (int k = 0; k < 3; ++k) {
    key[static_cast<std::size_t>(k)] =
        static_cast<std::int64_t>(std::floor(p[k] * 1000.0 + 0.3137));
  }
  return key;
}

void connect(PatchComplex& complex) {
  static constexpr int kStart[] = {0, 1, 3, 0};
  static constexpr int kEnd[] = {1, 2, 2, 3};
  std::map<std::array<std::int64_t, 3>, std::uint32_t> corner_of;
  for (std::uint32_t p = 0; p < complex.patches.size(); ++p) {
    for (int c = 0; c < 4; ++c) {
      const auto [u, v] = corner_parameters(c);
      const auto [at, added] =
          corner_of.try_emplace(corner_key(complex.patches[p].evaluate(u, v).position),
                                static_cast<std::uint32_t>(complex.corners.size()));
      if (added) {
        complex.corners.push_back({p, static_cast<std::uint32_t>(c)});
      }
      complex.patches[p].corner[static_cast<std::size_t>(c)] = at->second;
    }
  }
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> edge_of;
  complex.border_vertices = complex.corners.size();
  for (std::uint32_t p = 0; p < complex.patches.size(); ++p) {
    Patch& patch = complex.patches[p];
    for (int side = 0; side < 4; ++side) {
      const std::uint32_t a = patch.corner[static_cast<std::size_t>(kStart[side])];
      const std::uint32_t b = patch.corner[static_cast<std::size_t>(kEnd[side])];
      const auto [at, added] = edge_of.try_emplace(
          {std::min(a, b), std::max(a, b)}, static_cast<std::uint32_t>(complex.edges.size()));
      const std::uint32_t segments = side_segments(patch, side);
      if (added) {
        complex.edges.push_back(
            {p, static_cast<std::uint8_t>(side), a > b, segments, complex.border_vertices});
        complex.border_vertices += segments - 1;
      }
      ensure(complex.edges[at->second].segments == segments, "patches agree on their edges");
      patch.edge[static_cast<std::size_t>(side)] = at->second;
    }
  }
}

void make_sphere(PatchComplex& complex, std::uint64_t triangles) {
  // Segments along the three axes of the cube.
  using Grid = std::array<std::uint32_t, 3>;
  const auto quads = [](const Grid& n) {
    const std::uint64_t a = n[0], b = n[1], c = n[2];
    return 2 * (a * b + b * c + c * a);
  };
  const double wanted = kGridShare * static_cast<double>(triangles);
  const std::uint32_t about = static_cast<std::uint32_t>(std::sqrt(wanted / 12.0));
  Grid best{1, 1, 1};
  double best_miss = 1e300;
  for (std::uint32_t n = std::max(about, 2U) - 1; n <= about + 1; ++n) {
    for (const Grid& grid : {Grid{n, n, n}, Grid{n, n, n + 1}, Grid{n, n + 1, n + 1}}) {
      const double miss = std::abs(2.0 * static_cast<double>(quads(grid)) - wanted);
      if (2 * quads(grid) <= triangles && miss < best_miss) {
        best_miss = miss;
        best = grid;
      }
    }
  }
  for (int face = 0; face < 6; ++face) {
    Patch patch;
    patch.side = static_cast<std::uint8_t>(face);
    patch.nu = best[static_cast<std::size_t>((face / 2 + 1) % 3)];
    patch.nv = best[static_cast<std::size_t>((face / 2 + 2) % 3)];
    complex.patches.push_back(patch);
  }
  complex.extent = 1.0;
  complex.area = 4.0 * kPi;
}

struct PlateGrid {
  std::uint32_t side = 1;    // along a cell's side
  std::uint32_t radial = 1;  // from a tunnel to the cell's side
  std::uint32_t rim = 1;     // from the cells to the rim
};

void make_plate(PatchComplex& complex, std::uint64_t tunnels, std::uint64_t triangles) {
  std::uint64_t columns = 1;
  while (columns * columns < tunnels) {
    ++columns;
  }
  const std::uint64_t rows = (tunnels + columns - 1) / columns;
  const std::uint64_t plain = columns * rows - tunnels;
  const auto quads = [&](const PlateGrid& g) {
    const std::uint64_t n = g.side, m = g.radial, r = g.rim;
    return 2 * (4 * tunnels * n * m + plain * n * n + 2 * (columns + rows) * n * r + 4 * r * r);
  };
  if (2 * quads({}) > triangles) {
    throw UsageError("A scan of genus " + std::to_string(tunnels) + " needs at least " +
                     std::to_string(2 * quads({})) + " triangles.");
  }
  // The shape's proportions give the grid; for few triangles the nearest that is possible.
  const double wanted = kGridShare * static_cast<double>(triangles);
  const double per_square =
      static_cast<double>(4 * (24 * tunnels + 10 * plain + 6 * (columns + rows) + 4)) / 10.0;
  const std::uint32_t about = static_cast<std::uint32_t>(std::sqrt(wanted / per_square));
  PlateGrid best;
  double best_miss = 1e300;
  for (std::uint32_t n = about > 3 ? about - 3 : 1; n <= about + 3; ++n) {
    const std::uint32_t m_high = std::max(1U, (3 * n + 3) / 4);
    for (std::uint32_t m = std::max(1U, n * 9 / 20); m <= m_high; ++m) {
      const PlateGrid grid{n, m, std::max(1U, (3 * n + 5) / 10)};
      if (2 * quads(grid) > triangles) {
        continue;
      }
      const double given = 2.0 * static_cast<double>(quads(grid));
      // Even spacing breaks ties between grids of about the right size.
      const double miss =
          std::abs(given / wanted - 1.0) + 0.3 * std::abs(static_cast<double>(m) / n - 0.6);
      if (miss < best_miss) {
        best_miss = miss;
        best = grid;
      }
    }
  }

  const auto add = [&](PatchKind kind, int side, double cx, double cy, std::uint32_t nu,
                       std::uint32_t nv) {
    Patch patch;
    patch.kind = kind;
    patch.side = static_cast<std::uint8_t>(side);
    patch.cx = cx;
    patch.cy = cy;
    patch.nu = nu;
    patch.nv = nv;
    complex.patches.push_back(patch);
    patch.bottom = true;
    std::swap(patch.nu, patch.nv);
    complex.patches.push_back(patch);
  };
  for (std::uint64_t cell = 0; cell < columns * rows; ++cell) {
    const std::uint64_t column = cell % columns;
    const std::uint64_t row = cell / columns;
    const double cx = 2.0 * static_cast<double>(column) - static_cast<double>(columns - 1);
    const double cy = 2.0 * static_cast<double>(row) - static_cast<double>(rows - 1);
    const bool is_outer[4] = {column + 1 == columns, row + 1 == rows, column == 0, row == 0};
    if (cell >= tunnels) {
      add(PatchKind::kPlate, 0, cx, cy, best.side, best.side);
    }
    for (int side = 0; side < 4; ++side) {
      if (cell < tunnels) {
        add(PatchKind::kTunnelSector, side, cx, cy, best.radial, best.side);
      }
      if (is_outer[side]) {
        add(PatchKind::kRim, side, cx, cy, best.rim, best.side);
        if (is_outer[(side + 1) % 4]) {
          add(PatchKind::kCorner, side, cx, cy, best.rim, best.rim);
        }
      }
    }
  }
  complex.extent = static_cast<double>(std::max(columns, rows)) + kRimRounding;
  complex.area = 10.0 * static_cast<double>(columns * rows);
}

}  // namespace

BasePoint Patch::evaluate(double u, double v) const {
  if (kind == PatchKind::kCubeFace) {
    return cube_face(side, u, v);
  }
  if (bottom) {
    std::swap(u, v);
  }
  BasePoint point;
  switch (kind) {
    case PatchKind::kTunnelSector:
      point = tunnel_sector(u, v);
      break;
    case PatchKind::kRim:
      point = rounded({1.0, tangent(v), 0.0}, 1.0, 0.0, u);
      break;
    case PatchKind::kCorner:
      point = plate_corner(u, v);
      break;
    default:
      point = {{tangent(u), tangent(v), kHalfThickness}, {0.0, 0.0, 1.0}};
      break;
  }
  point.position = turned(point.position, side) + Vec3d(cx, cy, 0.0);
  point.normal = turned(point.normal, side);
  if (bottom) {
    point.position.z() = -point.position.z();
    point.normal.z() = -point.normal.z();
  }
  return point;
}

std::uint64_t PatchComplex::quads() const {
  std::uint64_t sum = 0;
  for (const Patch& patch : patches) {
    sum += patch.quads();
  }
  return sum;
}

std::uint64_t PatchComplex::border_vertex(const Patch& patch, std::uint32_t i,
                                          std::uint32_t j) const {
  const bool i_ends = i == 0 || i == patch.nu;
  const bool j_ends = j == 0 || j == patch.nv;
  if (i_ends && j_ends) {
    return patch.corner[j == 0 ? (i == 0 ? 0 : 1) : (i == 0 ? 3 : 2)];
  }
  const std::size_t side = j_ends ? (j == 0 ? 0 : 2) : (i == 0 ? 3 : 1);
  const PatchEdge& edge = edges[patch.edge[side]];
  const std::uint32_t along = j_ends ? i : j;
  // The side's direction against the edge's: from the lower corner to the higher.
  const std::uint32_t start = patch.corner[side == 1 ? 1 : (side == 2 ? 3 : 0)];
  const std::uint32_t end = patch.corner[side == 0 ? 1 : (side == 3 ? 3 : 2)];
  return edge.first_vertex + (start < end ? along : edge.segments - along) - 1;
}

PatchComplex make_patches(int genus, std::uint64_t triangles) {
  PatchComplex complex;
  if (genus == 0) {
    make_sphere(complex, triangles);
  } else {
    make_plate(complex, static_cast<std::uint64_t>(genus), triangles);
  }
  connect(complex);
  return complex;
}

}  // namespace rattan::synth
