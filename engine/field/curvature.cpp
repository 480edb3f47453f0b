// SPDX-License-Identifier: MIT
//
// Based on: D. Cohen-Steiner, J.-M. Morvan, "Restricted Delaunay triangulations and normal cycle",
// 2003. Changed: the dihedral angle beta is taken as 2 sin(beta / 2) (bounded, no transcendental
// function, the same to second order), and the neighbourhood is grown by repeated local sharing,
// so that one halo ring is enough.
#include "engine/field/curvature.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace rattan {

namespace {

constexpr int kMostRounds = 6;

// A round deals out a vertex's measure in equal shares to itself and its neighbours, so that
// nothing is lost or gained. (Averaging what the neighbours have would count well-connected
// vertices more: curvature 9 % too low on a grid of alternating diagonals.) Measures are stored as
// shares.
double share_of(std::uint32_t row_begin, std::uint32_t row_end) {
  return 1.0 / (row_end - row_begin + 1.0);
}

struct SurfaceState {
  FanView fans;
  HaloView<Vec3f> positions;
  std::vector<float> weight;
  std::vector<float> diagonal;
  std::vector<Vec3f> normal;
  std::vector<float> area;
  std::vector<CurvatureMeasure> curvature;
  Matching matching;
};

// Normal, area and raw curvature measure of every owned vertex, from its fan alone.
void surface_of_tile(const std::vector<Vec3f>& p, SurfaceState& s) {
  const std::uint32_t owned = s.fans.owned();
  const std::uint32_t* row = s.fans.row_begin.span().data();
  const std::uint32_t* neighbor = s.fans.neighbor.span().data();
  s.normal.resize(owned);
  s.area.resize(owned);
  s.curvature.resize(owned);
  for (std::uint32_t i = 0; i < owned; ++i) {
    const std::uint32_t begin = row[i];
    const std::uint32_t end = row[i + 1];
    const bool open = (s.fans.flags[i] & kOnBoundary) != 0;
    const Vec3d at = p[i].cast<double>();
    Vec3d total = Vec3d::Zero();
    double area = 0.0;
    double t[6] = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    // The edge to `a` lies between the triangle before (unit normal n_before) and the one after.
    const auto fold = [&](const Vec3d& a, const Vec3d& n_right, const Vec3d& n_left) {
      const double bend2 = (n_left - n_right).squaredNorm();
      const double length2 = a.squaredNorm();
      if (bend2 == 0.0 || length2 == 0.0) {
        return;
      }
      // Half of the edge belongs to either end: beta * (length / 2) * a a^T / length^2.
      const double f =
          (n_right.cross(n_left).dot(a) < 0.0 ? 0.5 : -0.5) * std::sqrt(bend2 / length2);
      t[0] += f * a.x() * a.x();
      t[1] += f * a.y() * a.y();
      t[2] += f * a.z() * a.z();
      t[3] += f * a.x() * a.y();
      t[4] += f * a.x() * a.z();
      t[5] += f * a.y() * a.z();
    };
    const auto unit = [](const Vec3d& c, double norm, const Vec3d& otherwise) -> Vec3d {
      return norm > 1e-280 ? Vec3d(c * (1.0 / norm)) : otherwise;
    };
    Vec3d a = p[neighbor[open ? begin : end - 1]].cast<double>() - at;
    Vec3d n_before = Vec3d::Zero();
    Vec3d n_first = Vec3d::Zero();
    Vec3d first_edge = Vec3d::Zero();
    bool started = false;
    for (std::uint32_t k = open ? begin + 1 : begin; k < end; ++k) {
      const Vec3d b = p[neighbor[k]].cast<double>() - at;
      const Vec3d c = a.cross(b);
      const double norm = std::sqrt(c.squaredNorm());
      total += c;
      area += norm;
      if (norm > 1e-280) {
        const Vec3d n = unit(c, norm, n_before);
        if (started) {
          fold(a, n_before, n);
        } else {
          n_first = n;
          first_edge = a;
          started = true;
        }
        n_before = n;
      }
      a = b;
    }
    if (!open && started) {
      fold(first_edge, n_before, n_first);
    }
    const double norm = std::sqrt(total.squaredNorm());
    s.normal[i] = unit(total, norm, Vec3d(0.0, 0.0, 1.0)).cast<float>();
    s.area[i] = static_cast<float>(area / 6.0);
    CurvatureMeasure& m = s.curvature[i];
    const double share = share_of(begin, end);
    for (int c = 0; c < 6; ++c) {
      m.m[c] = static_cast<float>(share * t[c]);
    }
    m.m[6] = static_cast<float>(share * area / 6.0);
    m.m[7] = 0.0F;
  }
}

struct AverageState {
  FanView fans;
  HaloView<CurvatureMeasure> in;
  HaloView<Vec3f> normals;
  std::vector<CurvatureMeasure> out;
  std::vector<Vec3f> out_normals;
};

void average(AverageState& s) {
  const std::vector<CurvatureMeasure> in = s.in.gather();
  const std::uint32_t owned = s.fans.owned();
  const std::uint32_t* row = s.fans.row_begin.span().data();
  const std::uint32_t* neighbor = s.fans.neighbor.span().data();
  s.out.resize(owned);
  for (std::uint32_t i = 0; i < owned; ++i) {
    std::array<float, 8> sum = in[i].m;
    for (std::uint32_t k = row[i]; k < row[i + 1]; ++k) {
      const std::array<float, 8>& m = in[neighbor[k]].m;
      for (int c = 0; c < 8; ++c) {
        sum[c] += m[c];
      }
    }
    const auto scale = static_cast<float>(share_of(row[i], row[i + 1]));
    for (int c = 0; c < 8; ++c) {
      s.out[i].m[c] = sum[c] * scale;
    }
  }
}

// Where a fan is folded over, its normal points into the surface and the field around it has to
// make up for a whole sphere of turns: eight singularities for one vertex. Such a vertex takes the
// neighbours' normal. (Averaging all normals leaves fewer singularities, but quads less square.)
void unfold_normals(AverageState& s) {
  const std::vector<Vec3f> in = s.normals.gather();
  const std::uint32_t owned = s.fans.owned();
  const std::uint32_t* row = s.fans.row_begin.span().data();
  const std::uint32_t* neighbor = s.fans.neighbor.span().data();
  s.out_normals.assign(in.begin(), in.begin() + owned);
  for (std::uint32_t i = 0; i < owned; ++i) {
    Vec3f around = Vec3f::Zero();
    for (std::uint32_t k = row[i]; k < row[i + 1]; ++k) {
      around += in[neighbor[k]];
    }
    const float norm = std::sqrt(around.squaredNorm());
    if (around.dot(in[i]) < 0.0F && norm > 1e-6F) {
      s.out_normals[i] = around / norm;
    }
  }
}

}  // namespace

int curvature_rounds(const ScanMesh& mesh, double reach) {
  const double edges = 0.5 * reach / std::max(mesh.mean_edge_length, 1e-300);
  return std::clamp(static_cast<int>(std::floor(edges * edges + 0.5)), 1, kMostRounds);
}

double prepare_surface(Store& store, const ScanMesh& mesh, const GeometryOptions& options,
                       TaskGraph& tasks, FirstMatching* matching) {
  const std::uint32_t tiles = mesh.layout.tile_count();
  double total_area = 0.0;
  {
    BoardWriter<Vec3f> normals(fields::kNormal, mesh.layout);
    BoardWriter<CurvatureMeasure> curvature(fields::kCurvature, mesh.layout);
    run_pass<SurfaceState>(
        tasks, "surface", tiles,
        [&](TileId id, SurfaceState& s) {
          s.fans.load(store, id);
          s.positions.load(store, fields::kSmoothPosition, fields::kMeshHalo, id);
        },
        [&](TileId, SurfaceState& s) {
          const std::vector<Vec3f> p = s.positions.gather();
          fan_weights(s.fans, p, options.energy, s.weight, s.diagonal);
          surface_of_tile(p, s);
          if (matching != nullptr) {
            s.matching = match_twice(s.fans.row_begin.span(), s.fans.neighbor.span(), s.weight);
          }
        },
        [&](TileId id, SurfaceState& s) {
          write(store, fields::kEdgeWeight, id, s.weight);
          write(store, fields::kDiagonal, id, s.diagonal);
          write(store, fields::kVertexArea, id, s.area);
          normals.commit(store, fields::kMeshHalo, id, s.normal);
          curvature.commit(store, fields::kMeshHalo, id, s.curvature);
          if (matching != nullptr) {
            matching->commit(id, s.matching);
          }
          for (const float a : s.area) {
            total_area += static_cast<double>(a);
          }
        });
    normals.finish(store);
    curvature.finish(store);
  }
  for (int round = 0; round < options.curvature_rounds; ++round) {
    const bool unfolds = round == 0;
    BoardWriter<CurvatureMeasure> curvature(fields::kCurvature, mesh.layout);
    std::optional<BoardWriter<Vec3f>> unfolded;
    if (unfolds) {
      unfolded.emplace(fields::kNormal, mesh.layout);
    }
    run_pass<AverageState>(
        tasks, "curvature", tiles,
        [&](TileId id, AverageState& s) {
          s.fans.load(store, id);
          s.in.load(store, fields::kCurvature, fields::kMeshHalo, id);
          if (unfolds) {
            s.normals.load(store, fields::kNormal, fields::kMeshHalo, id);
          }
        },
        [&](TileId, AverageState& s) {
          average(s);
          if (unfolds) {
            unfold_normals(s);
          }
        },
        [&](TileId id, AverageState& s) {
          curvature.commit(store, fields::kMeshHalo, id, s.out);
          if (unfolds) {
            unfolded->commit(store, fields::kMeshHalo, id, s.out_normals);
          }
        });
    if (unfolds) {
      unfolded->finish(store);
    }
    curvature.finish(store);
  }
  return total_area;
}

PrincipalDirections principal_directions(const CurvatureMeasure& measure, const Vec3d& frame_x,
                                         const Vec3d& frame_y, double floor_curvature) {
  PrincipalDirections p;
  const double area = static_cast<double>(measure.m[6]);
  if (!(area > 0.0)) {
    return p;
  }
  const auto form = [&](const Vec3d& u, const Vec3d& v) {
    const auto m = [&](int c) { return static_cast<double>(measure.m[c]); };
    return m(0) * u.x() * v.x() + m(1) * u.y() * v.y() + m(2) * u.z() * v.z() +
           m(3) * (u.x() * v.y() + u.y() * v.x()) + m(4) * (u.x() * v.z() + u.z() * v.x()) +
           m(5) * (u.y() * v.z() + u.z() * v.y());
  };
  const double a = form(frame_x, frame_x) / area;
  const double b = form(frame_x, frame_y) / area;
  const double c = form(frame_y, frame_y) / area;
  const double mean = 0.5 * (a + c);
  const double re = 0.5 * (a - c);
  const double half_gap = std::sqrt(re * re + b * b);
  // (re + i b) / half_gap is e^{2 i alpha} of the tensor's eigenvector of the larger eigenvalue,
  // that is of the direction across the one of that curvature. Of the two curvatures, mean +-
  // half_gap, the one with the sign of the mean is larger in size.
  const double sign = mean >= 0.0 ? 1.0 : -1.0;
  p.k1 = mean + sign * half_gap;
  p.k2 = mean - sign * half_gap;
  const double scale = 2.0 * (p.k1 * p.k1 + p.k2 * p.k2) + floor_curvature * floor_curvature;
  if (half_gap > 0.0 && scale > 0.0) {
    p.doubled = {-sign * re / half_gap, -sign * b / half_gap};
    p.fidelity = std::min(1.0, 4.0 * half_gap * half_gap / scale);
  }
  return p;
}

}  // namespace rattan
