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

constexpr Field<Vec3f> kFirstStep{"geometry/first_step"};

// The filter's rows in the order of the fans: x_i = (mass_i b_i + sum_j c_ij x_j) / total_i.
struct Rows {
  std::vector<float> coefficient;
  std::vector<float> mass;
  std::vector<float> inverse_total;
};

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

void relax(const FanView& fans, const Rows& rows, const std::vector<Vec3f>& b, int sweeps,
           std::vector<Vec3f>& x) {
  const std::uint32_t* row = fans.row_begin.span().data();
  const std::uint32_t* neighbor = fans.neighbor.span().data();
  const auto owned = static_cast<std::int64_t>(fans.owned());
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    const bool forward = sweep % 2 == 0;
    for (std::int64_t n = 0; n < owned; ++n) {
      const auto i = static_cast<std::size_t>(forward ? n : owned - 1 - n);
      if (rows.inverse_total[i] == 0.0F) {
        continue;
      }
      Vec3f sum = rows.mass[i] * b[i];
      for (std::uint32_t k = row[i]; k < row[i + 1]; ++k) {
        sum += rows.coefficient[k] * x[neighbor[k]];
      }
      x[i] = sum * rows.inverse_total[i];
    }
  }
}

struct State {
  FanView fans;
  ChunkView<Vec3f> positions;
  HaloView<Vec3f> target;
  HaloView<Vec3f> current;
  ChunkView<std::uint32_t> border;
  std::vector<Vec3f> result;
};

}  // namespace

double capped_low_pass_radius(const ScanMesh& mesh, double wanted) {
  const double cap =
      std::min(kMostEdges * mesh.mean_edge_length, kMostOfDiagonal * mesh.diagonal());
  return std::max(0.0, std::min(wanted, cap));
}

void low_pass_positions(Store& store, const ScanMesh& mesh, const LowPassOptions& options,
                        TaskGraph& tasks) {
  const std::uint32_t tiles = mesh.layout.tile_count();
  const double t = 0.25 * options.radius * options.radius;
  const bool filter = t > 0.0;
  // Step 0 solves S x from x into kFirstStep = y; step 1 solves z = S y, and leaves 2 y - z.
  for (int step = 0; step < (filter ? 2 : 1); ++step) {
    const int passes = filter ? options.passes : 1;
    for (int pass = 0; pass < passes; ++pass) {
      const bool last = pass + 1 == passes;
      const bool finish = last && (!filter || step == 1);
      const Field<Vec3f> out = filter && step == 0 ? kFirstStep : fields::kSmoothPosition;
      BoardWriter<Vec3f> writer(out, mesh.layout);
      run_pass<State>(
          tasks, "low-pass", tiles,
          [&](TileId id, State& s) {
            s.fans.load(store, id);
            s.positions = read(store, fields::kPosition, id);
            if (step == 1) {
              s.target.load(store, kFirstStep, fields::kMeshHalo, id);
            }
            if (pass > 0) {
              s.current.load(store, out, fields::kMeshHalo, id);
            }
          },
          [&](TileId, State& s) {
            const std::vector<Vec3f> original(s.positions.begin(), s.positions.end());
            const std::vector<Vec3f> b = step == 0 ? original : s.target.gather();
            std::vector<Vec3f> x = pass > 0 ? s.current.gather() : b;
            if (filter) {
              relax(s.fans, filter_rows(s.fans, original, t), b, options.sweeps, x);
              if (finish) {
                for (std::uint32_t i = 0; i < s.fans.owned(); ++i) {
                  x[i] = 2.0F * b[i] - x[i];
                }
              }
            }
            x.resize(s.fans.owned());
            s.result = std::move(x);
          },
          [&](TileId id, State& s) { writer.commit(store, fields::kMeshHalo, id, s.result); });
      writer.finish(store);
    }
  }
  store.erase(kFirstStep.name);
}

}  // namespace rattan
