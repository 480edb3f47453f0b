// SPDX-License-Identifier: MIT
//
// Based on: Sander, Snyder, Gortler, Hoppe, Texture Mapping Progressive Meshes (2001); PGP Table I.
#include "engine/param/distortion.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

#include "engine/core/exact_math.h"
#include "engine/mesh/halo_view.h"
#include "engine/param/phase_fields.h"

namespace rattan {

namespace {

// Bins are the exponent and the leading bits of L2 squared: no logarithm, nothing to round.
constexpr int kMantissaBits = 5;
constexpr int kShift = 52 - kMantissaBits;
constexpr std::uint64_t kFirstBin = std::uint64_t{1023 - 20} << kMantissaBits;  // L2 of 1 / 1024
constexpr std::size_t kBins = (std::size_t{40} << kMantissaBits) + 1;

std::size_t bin_of(double stretch2) {
  const std::uint64_t key = std::bit_cast<std::uint64_t>(stretch2) >> kShift;
  return key <= kFirstBin ? 0 : std::min<std::size_t>(key - kFirstBin, kBins - 1);
}

double normalised(double area, double parameter, double area_stretch2) {
  return area > 0.0 ? std::sqrt(area_stretch2 / area) * std::sqrt(parameter / area) : 1.0;
}

}  // namespace

TriangleDistortion triangle_distortion(const std::array<Vec3d, 3>& surface,
                                       const std::array<Vec2d, 3>& parameter) {
  const Vec3d p = surface[1] - surface[0];
  const Vec3d q = surface[2] - surface[0];
  const Vec2d x = parameter[1] - parameter[0];
  const Vec2d y = parameter[2] - parameter[0];
  TriangleDistortion d;
  d.area = 0.5 * std::sqrt(p.cross(q).squaredNorm());
  if (!(d.area > 0.0)) {
    return {};
  }
  const double twice = x.x() * y.y() - y.x() * x.y();
  d.parameter = 0.5 * twice;
  // S_u and S_v times twice the parametric area, which their angle doesn't depend on.
  const Vec3d u = y.y() * p - x.y() * q;
  const Vec3d v = x.x() * q - y.x() * p;
  const double u2 = u.squaredNorm();
  const double v2 = v.squaredNorm();
  const double stretch2 = 0.5 * (u2 + v2) / (twice * twice);
  const double most = kMostStretch * kMostStretch;
  d.stretch2 = stretch2 < most ? stretch2 : most;
  const double product = std::sqrt(u2) * std::sqrt(v2);
  d.shear = product > 0.0 ? std::min(1.0, std::abs(u.dot(v)) / product) : 1.0;
  return d;
}

void DistortionTotals::add(const TriangleDistortion& t) {
  area += t.area;
  parameter += std::abs(t.parameter);
  area_stretch2 += t.area * t.stretch2;
  area_shear += t.area * t.shear;
}

DistortionTotals& DistortionTotals::operator+=(const DistortionTotals& o) {
  area += o.area;
  parameter += o.parameter;
  area_stretch2 += o.area_stretch2;
  area_shear += o.area_shear;
  return *this;
}

double DistortionTotals::stretch() const {
  return normalised(area, parameter, area_stretch2);
}

double DistortionTotals::shear() const {
  return area > 0.0 ? area_shear / area : 0.0;
}

DistortionSums::DistortionSums() : bins_(kBins) {}

void DistortionSums::add(const TriangleDistortion& t) {
  totals_.add(t);
  Bin& bin = bins_[bin_of(t.stretch2)];
  bin.area += t.area;
  bin.parameter += std::abs(t.parameter);
  bin.area_stretch2 += t.area * t.stretch2;
}

void DistortionSums::merge(const DistortionSums& o) {
  totals_ += o.totals_;
  for (std::size_t i = 0; i < kBins; ++i) {
    bins_[i].area += o.bins_[i].area;
    bins_[i].parameter += o.bins_[i].parameter;
    bins_[i].area_stretch2 += o.bins_[i].area_stretch2;
  }
}

double DistortionSums::stretch_trimmed(double share) const {
  const double wanted = share * totals_.area;
  Bin sum;
  for (const Bin& bin : bins_) {
    if (!(bin.area > 0.0)) {
      continue;
    }
    const double part = std::min(1.0, (wanted - sum.area) / bin.area);
    sum.area += part * bin.area;
    sum.parameter += part * bin.parameter;
    sum.area_stretch2 += part * bin.area_stretch2;
    if (part < 1.0) {
      break;
    }
  }
  return normalised(sum.area, sum.parameter, sum.area_stretch2);
}

std::array<PhaseAngles, 3> corner_angles(const TileMesh& mesh, const TileCoordinates& coordinates,
                                         std::uint32_t triangle) {
  const LocalTriangle& t = mesh.triangles[triangle];
  const auto carried = [&](const EdgeTransport& transport, std::uint32_t vertex) {
    PhaseAngles a = coordinates.angles[vertex];
    quarter_turns(transport.r, a.theta, a.phi);
    constexpr double kTurn = 2.0 * exact::kPi;
    return PhaseAngles{a.theta + kTurn * transport.s, a.phi + kTurn * transport.t};
  };
  return {coordinates.angles[t[0]], carried(coordinates.side_transport(3 * triangle), t[1]),
          carried(inverse(coordinates.side_transport(3 * triangle + 2)), t[2])};
}

DistortionSums tile_distortion(const TileMesh& mesh, const TileCoordinates& coordinates,
                               double omega) {
  DistortionSums sums;
  const double unit = omega / (2.0 * exact::kPi);
  for (std::uint32_t i = 0; i < mesh.counts.owned; ++i) {
    const std::array<PhaseAngles, 3> angles = corner_angles(mesh, coordinates, i);
    std::array<Vec3d, 3> surface;
    std::array<Vec2d, 3> parameter;
    for (int k = 0; k < 3; ++k) {
      surface[k] = mesh.positions[mesh.triangles[i][k]].cast<double>();
      parameter[k] = unit * Vec2d(angles[k].theta, angles[k].phi);
    }
    sums.add(surface, parameter);
  }
  return sums;
}

DistortionSums measure_distortion(Store& store, const ScanMesh& mesh, double omega,
                                  TaskGraph& tasks) {
  struct State {
    TileMesh tile;
    HaloView<VertexFrame> frames;
    HaloView<PairValue> phases;
    std::optional<DistortionSums> sums;
  };
  DistortionSums all;
  run_pass<State>(
      tasks, "distortion", mesh.layout.tile_count(),
      [&](TileId id, State& s) {
        s.tile = load_tile(store, mesh, id);
        s.frames.load(store, fields::kFrame, fields::kMeshHalo, id);
        s.phases.load(store, fields::kPhase, fields::kMeshHalo, id);
      },
      [&](TileId, State& s) {
        const std::vector<VertexFrame> frames = s.frames.gather();
        const std::vector<PairValue> phases = s.phases.gather();
        s.sums = tile_distortion(s.tile, tile_coordinates(s.tile, frames, phases, omega), omega);
      },
      [&](TileId, State& s) { all.merge(*s.sums); });
  return all;
}

}  // namespace rattan
