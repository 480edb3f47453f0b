// SPDX-License-Identifier: MIT
//
// Based on: PGP 4.2, with the corrections that angles are multiplied by N before and divided after,
// K = cos(alpha) H + sin(alpha) N x H, and a fidelity bounded by 1 instead of the ratio of
// curvatures.
#include "engine/field/smoothing.h"

#include <algorithm>
#include <cmath>

#include "engine/field/curvature.h"
#include "engine/field/tangent_frame.h"
#include "engine/mesh/wanted_direction.h"

namespace rattan {

namespace {

// The boundary's pull against the sum of a vertex's edge weights.
constexpr double kBoundaryFit = 4.0;
// The edges of curves at one vertex have to agree by this much, modulo quarter turns.
constexpr double kCurveAgreement = 0.5;
// Cosine within which a solution is taken to follow a curve.
constexpr double kFollows = 0.87;

struct State {
  FanView fans;
  HaloView<Vec3f> normals;
  HaloView<Vec3f> positions;
  ChunkView<std::uint64_t> halo_ids;
  ChunkView<CurvatureMeasure> curvature;
  ChunkView<VertexDirection> wanted;
  ChunkView<float> weight;
  ChunkView<float> diagonal;
  ChunkView<float> area;
  std::vector<ComplexBlock::Coefficient> coefficient;
  std::vector<float> fit;
  std::vector<Complex> rhs;
  BorderGauges<ComplexBlock>::Tile gauges;
  double fit_sum = 0.0;
};

// e^{i N alpha} of a vector projected into the frame, times the vector's projected length.
Complexd power_of(const TangentFrame& frame, const Vec3d& v, int n) {
  const Complexd z(frame.x.dot(v), frame.y.dot(v));
  const double length = std::abs(z.real()) + std::abs(z.imag()) > 0.0
                            ? std::sqrt(z.real() * z.real() + z.imag() * z.imag())
                            : 0.0;
  if (length == 0.0) {
    return {0.0, 0.0};
  }
  return symmetry_power(Complexd(z.real() / length, z.imag() / length), n) * length;
}

struct Fit {
  Complexd target{0.0, 0.0};  // unit, or 0
  double weight = 0.0;
};

Fit curvature_fit(const CurvatureMeasure& m, const TangentFrame& frame, int n,
                  double floor_curvature) {
  const PrincipalDirections p = principal_directions(m, frame.x, frame.y, floor_curvature);
  Fit f;
  if (!(p.fidelity > 0.0)) {
    return f;
  }
  f.weight = p.fidelity;
  if (n == 4) {
    f.target = symmetry_power(p.doubled, 2);
  } else if (n == 2) {
    f.target = p.doubled;
  } else {
    // A principal direction has no sign. It is pointed along a fixed direction of space, and counts
    // as much as that direction says anything about it.
    const Complexd z = symmetry_root(p.doubled, 2);
    const Vec3d k = z.real() * frame.x + z.imag() * frame.y;
    const double along = k.dot(Vec3d(0.48, 0.60, 0.64));
    f.target = along >= 0.0 ? z : -z;
    f.weight *= along * along;
  }
  return f;
}

/// The given vector's part in the tangent plane; the steeper it stands, the less it says.
Fit wanted_fit(const VertexDirection& wanted, const TangentFrame& frame, int n) {
  const Vec3d v = wanted.direction.cast<double>();
  const double length = v.norm();
  Fit f;
  if (length > 0.0 && wanted.fidelity > 0.0F) {
    const Complexd z = power_of(frame, v / length, n);
    f.target = unit_or(z, Complexd(0.0, 0.0));
    f.weight = static_cast<double>(wanted.fidelity) * std::sqrt(std::norm(z));
  }
  return f;
}

bool follows_features(const SmoothingOptions& options) {
  return options.features != nullptr && !options.features->empty() &&
         options.symmetry == Symmetry::kFour;
}

/// The fit at a vertex of feature curves: all their edges there, each by its length. Modulo a
/// quarter turn the sides of a right-angled corner agree.
Fit curve_fit(const TangentFrame& frame, const std::vector<Vec3f>& p, std::uint32_t vertex,
              std::span<const std::uint32_t> neighbors, double diagonal) {
  const Vec3d at = p[vertex].cast<double>();
  Complexd sum(0.0, 0.0);
  double lengths = 0.0;
  for (const std::uint32_t j : neighbors) {
    const Complexd z = power_of(frame, p[j].cast<double>() - at, 4);
    sum += z;
    lengths += std::sqrt(z.real() * z.real() + z.imag() * z.imag());
  }
  Fit f;
  const double length = std::sqrt(sum.real() * sum.real() + sum.imag() * sum.imag());
  if (length > kCurveAgreement * lengths) {
    f.target = unit_or(sum, Complexd(0.0, 0.0));
    f.weight = kBoundaryFit * diagonal;
  }
  return f;
}

/// Sets the field to the tangent of the curves where it is near already, and pins it if `pinned`
/// says so of the vertex.
template <class Pinned>
void follow_curves(const TileFeatures& features, const std::vector<Vec3f>& p, const Pinned& pinned,
                   std::vector<VertexFrame>& frames) {
  for (const FeatureMark& m : features.marks) {
    VertexFrame& frame = frames[m.vertex];
    const bool pin = pinned(m.vertex);
    // The loose end of a curve is as good as its inner points.
    if (m.corner && m.neighbors != 1) {
      frame.pins = pin ? kPinBoth : 0;
      continue;
    }
    const auto ends = features.neighbors(m);
    const Vec3d n = frame.normal.cast<double>();
    const std::uint32_t before = m.neighbors == 1 ? m.vertex : ends[1];
    Vec3d tangent = p[before].cast<double>() - p[ends[0]].cast<double>();
    tangent -= n.dot(tangent) * n;
    const double length = std::sqrt(tangent.squaredNorm());
    if (!(length > 0.0)) {
      continue;
    }
    tangent /= length;
    const Vec3d k = frame.direction.cast<double>();
    const double along = k.dot(tangent);
    const double across = n.cross(k).dot(tangent);
    const bool follows = std::abs(along) >= std::abs(across);
    if (std::max(std::abs(along), std::abs(across)) < kFollows) {
      continue;
    }
    Vec3d to = along >= 0.0 ? tangent : Vec3d(-tangent);
    if (!follows) {
      // K_perp along the tangent: K is the tangent turned back by a quarter.
      to = across >= 0.0 ? Vec3d(-n.cross(tangent)) : n.cross(tangent);
    }
    frame.direction = to.cast<float>();
    frame.pins = pin ? (follows ? kPinPhi : kPinTheta) : 0;
  }
}

void assemble_tile(State& s, const SmoothingOptions& options, const TileExtent& extent) {
  const std::vector<Vec3f> normals = s.normals.gather();
  const std::vector<Vec3f> p = s.positions.gather();
  const int n = static_cast<int>(options.symmetry);
  const std::uint32_t owned = s.fans.owned();
  const std::uint32_t* row = s.fans.row_begin.span().data();
  const std::uint32_t* neighbor = s.fans.neighbor.span().data();
  std::vector<TangentFrame> frames(normals.size());
  for (std::size_t i = 0; i < normals.size(); ++i) {
    frames[i] = tangent_frame(normals[i].cast<double>());
  }
  s.coefficient.resize(s.fans.neighbor.size());
  s.fit.assign(owned, 0.0F);
  s.rhs.assign(owned, Complex(0.0F, 0.0F));
  const double per_area = 1.0 / (options.fitting_length * options.fitting_length);
  const TileFeatures features = follows_features(options)
                                    ? options.features->of_tile(extent, s.halo_ids.span())
                                    : TileFeatures{};
  auto mark = features.marks.begin();
  for (std::uint32_t i = 0; i < owned; ++i) {
    for (std::uint32_t k = row[i]; k < row[i + 1]; ++k) {
      const Complexd z = symmetry_power(transport(frames[i], frames[neighbor[k]]), n);
      const auto w = static_cast<double>(s.weight[k]);
      s.coefficient[k].c =
          Complex(static_cast<float>(w * z.real()), static_cast<float>(w * z.imag()));
    }
    Fit f;
    const bool given = s.wanted.size() > 0;
    if (given) {
      f = wanted_fit(s.wanted[i], frames[i], n);
      f.weight *= static_cast<double>(s.area[i]) * per_area;
    }
    const bool on_curve = mark != features.marks.end() && mark->vertex == i;
    const auto curve = mark;
    mark += on_curve ? 1 : 0;
    if (f.weight > 0.0) {
      // As given, also on curves and at the boundary.
    } else if (on_curve) {
      f = curve_fit(frames[i], p, i, features.neighbors(*curve),
                    static_cast<double>(s.diagonal[i]));
    } else if (options.align_boundary && n == 4 && (s.fans.flags[i] & kOnBoundary) != 0) {
      // Both boundary edges, each by its length; modulo a quarter turn a right-angled corner
      // agrees.
      const Vec3d at = p[i].cast<double>();
      const Complexd sum = power_of(frames[i], p[neighbor[row[i]]].cast<double>() - at, n) +
                           power_of(frames[i], p[neighbor[row[i + 1] - 1]].cast<double>() - at, n);
      f.target = unit_or(sum, Complexd(0.0, 0.0));
      f.weight = kBoundaryFit * static_cast<double>(s.diagonal[i]);
    } else if (!given) {
      f = curvature_fit(s.curvature[i], frames[i], n, options.floor_curvature);
      f.weight *= static_cast<double>(s.area[i]) * per_area;
    }
    if (f.target == Complexd(0.0, 0.0)) {
      continue;
    }
    s.fit[i] = static_cast<float>(f.weight);
    s.rhs[i] = Complex(static_cast<float>(f.weight * f.target.real()),
                       static_cast<float>(f.weight * f.target.imag()));
    s.fit_sum += f.weight;
  }
}

}  // namespace

double assemble_smoothing(Store& store, const ScanMesh& mesh, const SmoothingOptions& options,
                          TaskGraph& tasks, BorderGauges<ComplexBlock>* gauges) {
  const SystemFields<ComplexBlock>& system = fields::kSmoothingSystem;
  double fit_sum = 0.0;
  run_pass<State>(
      tasks, "smoothing", mesh.layout.tile_count(),
      [&](TileId id, State& s) {
        s.fans.load(store, id);
        s.normals.load(store, fields::kNormal, fields::kMeshHalo, id);
        s.positions.load(store, fields::kSmoothPosition, fields::kMeshHalo, id);
        if (has_wanted_directions(store)) {
          s.wanted = read(store, fields::kWantedDirection, id);
        } else {
          s.curvature = read(store, fields::kCurvature, id);
        }
        s.halo_ids = read(store, fields::kMeshHalo.halo_ids, id);
        s.weight = read(store, fields::kEdgeWeight, id);
        s.diagonal = read(store, fields::kDiagonal, id);
        s.area = read(store, fields::kVertexArea, id);
        if (gauges != nullptr) {
          gauges->load(id, s.gauges);
        }
      },
      [&](TileId id, State& s) {
        assemble_tile(s, options, mesh.layout.tiles[id.value]);
        BorderGauges<ComplexBlock>::compute(s.fans.row_begin.span(), s.fans.neighbor.span(),
                                            s.coefficient, s.gauges);
      },
      [&](TileId id, State& s) {
        if (gauges != nullptr) {
          gauges->commit(id, s.gauges);
        }
        write(store, system.coefficient, id, s.coefficient);
        write(store, system.fit, id, s.fit);
        write(store, system.rhs, id, s.rhs);
        fit_sum += s.fit_sum;
      });
  return fit_sum;
}

class FrameWriter::Tile final : public SolutionTask<ComplexBlock> {
 public:
  Tile(FrameWriter& writer, TileId id) : writer_(writer), id_(id) {}
  void load() override {
    Store& store = writer_.store_;
    position_.load(store, fields::kSmoothPosition, fields::kMeshHalo, id_);
    normal_ = read(store, fields::kNormal, id_);
    halo_ids_ = read(store, fields::kMeshHalo.halo_ids, id_);
    flags_ = read(store, fields::kVertexFlag, id_);
  }
  void compute(std::span<const Complex> solution) override {
    const SmoothingOptions& options = writer_.options_;
    const int n = static_cast<int>(options.symmetry);
    frames_.resize(normal_.size());
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      const TangentFrame f = tangent_frame(normal_[i].cast<double>());
      const Complexd z(static_cast<double>(solution[i].real()),
                       static_cast<double>(solution[i].imag()));
      const Complexd a = symmetry_root(unit_or(z, Complexd(1.0, 0.0)), n);
      const Vec3d k = a.real() * f.x + a.imag() * f.y;
      frames_[i] = {position_.owned[i], normal_[i], k.cast<float>(), 1.0F, 0};
    }
    if (writer_.features_) {
      const TileExtent& extent = writer_.mesh_.layout.tiles[id_.value];
      const auto pinned = [&](std::uint32_t i) {
        return options.pin || (options.pin_boundary && (flags_[i] & kOnBoundary) != 0);
      };
      follow_curves(options.features->of_tile(extent, halo_ids_.span()), position_.gather(), pinned,
                    frames_);
    }
  }
  void commit() override { writer_.board_.commit(writer_.store_, fields::kMeshHalo, id_, frames_); }

 private:
  FrameWriter& writer_;
  TileId id_;
  HaloView<Vec3f> position_;
  ChunkView<Vec3f> normal_;
  ChunkView<std::uint64_t> halo_ids_;
  ChunkView<std::uint8_t> flags_;
  std::vector<VertexFrame> frames_;
};

// Directions that come with the scan count for more than its curves.
FrameWriter::FrameWriter(Store& store, const ScanMesh& mesh, const SmoothingOptions& options)
    : store_(store),
      mesh_(mesh),
      options_(options),
      features_(follows_features(options) && !has_wanted_directions(store)),
      board_(fields::kFrame, mesh.layout) {}

std::unique_ptr<SolutionTask<ComplexBlock>> FrameWriter::tile(TileId id) {
  return std::make_unique<Tile>(*this, id);
}

void FrameWriter::finish() {
  board_.finish(store_);
}

}  // namespace rattan
