// SPDX-License-Identifier: MIT
#include "engine/field/low_pass.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace rattan {

namespace {

// Beyond four edges the relaxation would need a hierarchy, and noise is gone anyway.
constexpr double kMostEdges = 4.0;
constexpr double kMostOfDiagonal = 0.02;

// Passes over the tiles for each of the two filter steps.
constexpr int kPasses = 2;

constexpr Field<Vec3f> kFirstStep{"geometry/first_step"};

// The filter's rows in the order of the fans: x_i = (mass_i b_i + sum_j c_ij x_j) / total_i. Made
// by the first pass and kept for the others.
constexpr Field<float> kCoefficient{"geometry/filter_coefficient"};
constexpr Field<float> kMass{"geometry/filter_mass"};
constexpr Field<float> kInverseTotal{"geometry/filter_inverse_total"};

struct Rows {
  std::vector<float> coefficient;
  std::vector<float> mass;
  std::vector<float> inverse_total;
};

// Padded, so that a point is one register.
using Point = Eigen::Vector4f;

std::vector<Point> padded(const std::vector<Vec3f>& p) {
  std::vector<Point> q(p.size());
  for (std::size_t i = 0; i < p.size(); ++i) {
    q[i] = Point(p[i].x(), p[i].y(), p[i].z(), 0.0F);
  }
  return q;
}

// Along feature curves, or not at all at corners.
void bind_to_curves(const FanView& fans, const std::vector<Vec3f>& p, double t,
                    const TileFeatures& features, Rows& rows) {
  for (const FeatureMark& m : features.marks) {
    const std::uint32_t begin = fans.row_begin[m.vertex];
    const std::uint32_t end = fans.row_begin[m.vertex + 1];
    std::fill(rows.coefficient.begin() + begin, rows.coefficient.begin() + end, 0.0F);
    rows.inverse_total[m.vertex] = 0.0F;
    if (m.corner) {
      continue;
    }
    double length = 0.0;
    for (const std::uint32_t j : features.neighbors(m)) {
      length += (p[j] - p[m.vertex]).cast<double>().norm();
    }
    const double least = 1e-3 * length + 1e-300;
    double total = 0.5 * length;
    rows.mass[m.vertex] = static_cast<float>(total);
    for (std::uint32_t k = begin; k < end; ++k) {
      for (const std::uint32_t j : features.neighbors(m)) {
        if (fans.neighbor[k] == j) {
          const double d = (p[j] - p[m.vertex]).cast<double>().norm();
          rows.coefficient[k] = static_cast<float>(t / std::max(d, least));
          total += t / std::max(d, least);
        }
      }
    }
    rows.inverse_total[m.vertex] = total > 1e-30 ? static_cast<float>(1.0 / total) : 0.0F;
  }
}

Rows filter_rows(const FanView& fans, const std::vector<Vec3f>& p, double t) {
  Rows rows;
  std::vector<float> diagonal;
  fan_weights(fans, p, EdgeEnergy::kTriangle, rows.coefficient, diagonal);
  const std::uint32_t owned = fans.owned();
  rows.mass.resize(owned);
  rows.inverse_total.resize(owned);
  for (std::uint32_t i = 0; i < owned; ++i) {
    const std::uint32_t begin = fans.row_begin[i];
    const std::uint32_t end = fans.row_begin[i + 1];
    const Vec3d at = p[i].cast<double>();
    double mass = 0.0;
    double sum = 0.0;
    if ((fans.flags[i] & kOnBoundary) != 0) {
      // Along the curve: neighbours on the boundary are the first and the last of the fan.
      const double a = (p[fans.neighbor[begin]].cast<double>() - at).norm();
      const double b = (p[fans.neighbor[end - 1]].cast<double>() - at).norm();
      const double least = 1e-3 * (a + b) + 1e-300;
      std::fill(rows.coefficient.begin() + begin, rows.coefficient.begin() + end, 0.0F);
      mass = 0.5 * (a + b);
      const double to_a = t / std::max(a, least);
      const double to_b = t / std::max(b, least);
      rows.coefficient[begin] = static_cast<float>(to_a);
      rows.coefficient[end - 1] = static_cast<float>(to_b);
      sum = to_a + to_b;
    } else {
      Vec3d a = p[fans.neighbor[end - 1]].cast<double>() - at;
      for (std::uint32_t k = begin; k < end; ++k) {
        const Vec3d b = p[fans.neighbor[k]].cast<double>() - at;
        mass += a.cross(b).norm() / 6.0;
        rows.coefficient[k] = static_cast<float>(t * static_cast<double>(rows.coefficient[k]));
        sum += static_cast<double>(rows.coefficient[k]);
        a = b;
      }
    }
    rows.mass[i] = static_cast<float>(mass);
    // A vertex whose triangles have no size at all stays where it is.
    rows.inverse_total[i] = mass + sum > 1e-30 ? static_cast<float>(1.0 / (mass + sum)) : 0.0F;
  }
  return rows;
}

struct State {
  FanView fans;
  HaloView<Vec3f> target;
  HaloView<Vec3f> current;
  ChunkView<Vec3f> positions;
  ChunkView<std::uint64_t> halo_ids;
  ChunkView<float> coefficient;
  ChunkView<float> mass;
  ChunkView<float> inverse_total;
  Rows made;
  std::vector<Vec3f> result;
};

void relax(const State& s, const std::vector<Point>& b, int sweeps, std::vector<Point>& x) {
  const bool fresh = !s.made.coefficient.empty();
  const float* coefficient = fresh ? s.made.coefficient.data() : s.coefficient.span().data();
  const float* mass = fresh ? s.made.mass.data() : s.mass.span().data();
  const float* inverse = fresh ? s.made.inverse_total.data() : s.inverse_total.span().data();
  const std::uint32_t* row = s.fans.row_begin.span().data();
  const std::uint32_t* neighbor = s.fans.neighbor.span().data();
  const auto owned = static_cast<std::int64_t>(s.fans.owned());
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    const bool forward = sweep % 2 == 0;
    for (std::int64_t n = 0; n < owned; ++n) {
      const auto i = static_cast<std::size_t>(forward ? n : owned - 1 - n);
      if (inverse[i] == 0.0F) {
        continue;
      }
      Point sum = mass[i] * b[i];
      for (std::uint32_t k = row[i]; k < row[i + 1]; ++k) {
        sum += coefficient[k] * x[neighbor[k]];
      }
      x[i] = sum * inverse[i];
    }
  }
}

}  // namespace

double capped_low_pass_radius(const ScanMesh& mesh, double wanted) {
  const double cap =
      std::min(kMostEdges * mesh.mean_edge_length, kMostOfDiagonal * mesh.diagonal());
  return std::max(0.0, std::min(wanted, cap));
}

void low_pass_positions(Store& store, const ScanMesh& mesh, const LowPassOptions& options,
                        TaskGraph& tasks) {
  const double t = 0.25 * options.radius * options.radius;
  const bool filter = t > 0.0;
  // The relaxation's reach has to grow with the filter's.
  const double edges = options.radius / std::max(mesh.mean_edge_length, 1e-300);
  const int sweeps = std::clamp(static_cast<int>(std::ceil(1.4 * edges)), 3, 8);
  // Step 0 solves S x from x into kFirstStep = y; step 1 solves z = S y, and leaves 2 y - z.
  const int passes = filter ? 2 * kPasses : 1;
  for (int pass = 0; pass < passes; ++pass) {
    const int step = pass / kPasses;
    const bool starts = pass % kPasses == 0;
    const bool finish = pass + 1 == passes;
    const Field<Vec3f> out = filter && step == 0 ? kFirstStep : fields::kSmoothPosition;
    BoardWriter<Vec3f> writer(out, mesh.layout);
    run_pass<State>(
        tasks, "low-pass", mesh.layout.tile_count(),
        [&](TileId id, State& s) {
          s.fans.load(store, id);
          if (step == 0) {
            s.positions = read(store, fields::kPosition, id);
            s.halo_ids = read(store, fields::kMeshHalo.halo_ids, id);
          } else {
            s.target.load(store, kFirstStep, fields::kMeshHalo, id);
          }
          if (!starts) {
            s.current.load(store, out, fields::kMeshHalo, id);
          }
          if (pass > 0) {
            s.coefficient = read(store, kCoefficient, id);
            s.mass = read(store, kMass, id);
            s.inverse_total = read(store, kInverseTotal, id);
          }
        },
        [&](TileId id, State& s) {
          const std::vector<Vec3f> target =
              step == 0 ? std::vector<Vec3f>(s.positions.begin(), s.positions.end())
                        : s.target.gather();
          const std::uint32_t owned = s.fans.owned();
          if (!filter) {
            s.result.assign(target.begin(), target.begin() + owned);
            return;
          }
          if (pass == 0) {
            s.made = filter_rows(s.fans, target, t);
            if (options.features != nullptr && !options.features->empty()) {
              bind_to_curves(
                  s.fans, target, t,
                  options.features->of_tile(mesh.layout.tiles[id.value], s.halo_ids.span()),
                  s.made);
            }
          }
          const std::vector<Point> b = padded(target);
          std::vector<Point> x = starts ? b : padded(s.current.gather());
          relax(s, b, sweeps, x);
          s.result.resize(owned);
          for (std::uint32_t i = 0; i < owned; ++i) {
            const Point y = finish ? Point(2.0F * b[i] - x[i]) : x[i];
            s.result[i] = Vec3f(y.x(), y.y(), y.z());
          }
        },
        [&](TileId id, State& s) {
          if (filter && pass == 0) {
            write(store, kCoefficient, id, s.made.coefficient);
            write(store, kMass, id, s.made.mass);
            write(store, kInverseTotal, id, s.made.inverse_total);
          }
          writer.commit(store, fields::kMeshHalo, id, s.result);
        });
    writer.finish(store);
  }
  for (const std::string_view name :
       {kFirstStep.name, kCoefficient.name, kMass.name, kInverseTotal.name}) {
    store.erase(name);
  }
}

}  // namespace rattan
