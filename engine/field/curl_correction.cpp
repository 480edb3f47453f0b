// SPDX-License-Identifier: MIT
//
// Based on: PGP 4.1. Changed: angles re-oriented inside the triangle by quarter turns; per-edge
// targets for clamped weights; v is divided by its geometric mean, not by its maximum.
#include "engine/field/curl_correction.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/core/exact_math.h"
#include "engine/field/tangent_frame.h"

namespace rattan {

namespace {

// Screening length of the weak pull, in diagonals of the bounding box.
constexpr double kScreening = 10.0;

// atan(y / x) for |y| <= |x|; exact only to 1e-9 but the same everywhere.
double small_angle(double y, double x) {
  const double t = y / x;
  if (std::abs(t) > 0.25) {
    return exact::atan2(t, 1.0);
  }
  const double z = t * t;
  return t * (1.0 + z * (-1.0 / 3.0 + z * (0.2 + z * (-1.0 / 7.0 + z * (1.0 / 9.0 - z / 11.0)))));
}

struct Turn {
  double angle = 0.0;
  int quarters = 0;
};

// From direction a to direction b (any length), modulo quarter turns: a times i^quarters times
// e^{i angle} points along b.
Turn turn_between(Complexd a, Complexd b) {
  const double re = b.real() * a.real() + b.imag() * a.imag();
  const double im = b.imag() * a.real() - b.real() * a.imag();
  if (re == 0.0 && im == 0.0) {
    return {};
  }
  if (std::abs(re) >= std::abs(im)) {
    return {small_angle(im, re), re >= 0.0 ? 0 : 2};
  }
  return {small_angle(-re, im), im >= 0.0 ? 1 : 3};
}

struct EdgeTarget {
  float exact = 0.0F;     // sum over triangles of cot / 2 times target
  float half_cot = 0.0F;  // sum of cot / 2
  float by_area = 0.0F;   // sum of area times target
  float area = 0.0F;      // sum of area
};

struct State {
  FanView fans;
  ChunkView<LocalTriangle> triangles;
  HaloView<VertexFrame> frames;
  ChunkView<float> weight;
  ChunkView<float> area;
  std::vector<float> fit;
  std::vector<float> rhs;
};

void assemble_tile(State& s, double pull) {
  const std::vector<VertexFrame> frames = s.frames.gather();
  const std::uint32_t owned = s.fans.owned();
  const std::uint32_t* row = s.fans.row_begin.span().data();
  const std::span<const std::uint32_t> neighbor = s.fans.neighbor.span();
  std::vector<EdgeTarget> target(neighbor.size());
  const auto add = [&](std::uint32_t i, std::uint32_t j, double half_cot, double area, double t) {
    if (i >= owned) {
      return;
    }
    EdgeTarget& e = target[find_neighbor(neighbor, row[i], j)];
    e.exact += static_cast<float>(half_cot * t);
    e.half_cot += static_cast<float>(half_cot);
    e.by_area += static_cast<float>(area * t);
    e.area += static_cast<float>(area);
  };
  for (const LocalTriangle& tri : s.triangles) {
    const std::array<const VertexFrame*, 3> f = {&frames[tri[0]], &frames[tri[1]], &frames[tri[2]]};
    std::array<Vec3d, 3> p;
    for (int c = 0; c < 3; ++c) {
      p[c] = f[c]->position.cast<double>();
    }
    const Vec3d ab = p[1] - p[0];
    const Vec3d ac = p[2] - p[0];
    const Vec3d normal = ab.cross(ac);
    const double twice_area = std::sqrt(normal.squaredNorm());
    const double length = std::sqrt(ab.squaredNorm());
    if (!(twice_area > 1e-6 * (ab.squaredNorm() + ac.squaredNorm()))) {
      continue;  // a sliver's gradient means nothing
    }
    const Vec3d n = normal / twice_area;
    const Vec3d x = ab / length;
    const Vec3d y = n.cross(x);
    std::array<Complexd, 3> z;
    for (int c = 0; c < 3; ++c) {
      const Vec3d k = f[c]->direction.cast<double>();
      const Vec3d k_perp = f[c]->normal.cast<double>().cross(k);
      z[c] = Complexd(x.dot(k) + y.dot(k_perp), y.dot(k) - x.dot(k_perp));
    }
    const Turn t_ab = turn_between(z[0], z[1]);
    const Turn t_bc = turn_between(z[1], z[2]);
    const Turn t_ca = turn_between(z[2], z[0]);
    if (((t_ab.quarters + t_bc.quarters + t_ca.quarters) & 3) != 0) {
      continue;
    }
    // grad gamma turned by +90 degrees, from gamma_b - gamma_a and gamma_c - gamma_a.
    const Vec3d g = (t_ab.angle * ac + t_ca.angle * ab) / twice_area;
    for (int c = 0; c < 3; ++c) {
      const int d = (c + 1) % 3;
      const double t = g.dot(p[d] - p[c]);
      const Vec3d& apex = p[(c + 2) % 3];
      const double half_cot = 0.5 * (p[c] - apex).dot(p[d] - apex) / twice_area;
      add(tri[c], tri[d], half_cot, twice_area, t);
      add(tri[d], tri[c], half_cot, twice_area, -t);
    }
  }
  s.fit.resize(owned);
  s.rhs.resize(owned);
  for (std::uint32_t i = 0; i < owned; ++i) {
    double b = 0.0;
    for (std::uint32_t k = row[i]; k < row[i + 1]; ++k) {
      const EdgeTarget& e = target[k];
      if (e.area > 0.0F) {
        // The right-hand side of Eq. 20, and for what clamping added to the weight (or a singular
        // triangle took from it) the mean target: consistent edge by edge, and without clamping
        // exactly Eq. 20.
        const double rest = static_cast<double>(s.weight[k]) - static_cast<double>(e.half_cot);
        b -= static_cast<double>(e.exact) +
             rest * static_cast<double>(e.by_area) / static_cast<double>(e.area);
      }
    }
    s.rhs[i] = static_cast<float>(b);
    s.fit[i] = static_cast<float>(pull * static_cast<double>(s.area[i]));
  }
}

}  // namespace

void assemble_curl(Store& store, const ScanMesh& mesh, TaskGraph& tasks) {
  const double reach = kScreening * std::max(mesh.diagonal(), 1e-30);
  const double pull = 1.0 / (reach * reach);
  run_pass<State>(
      tasks, "curl", mesh.layout.tile_count(),
      [&](TileId id, State& s) {
        s.fans.load(store, id);
        s.triangles = read(store, fields::kTriangle, id);
        s.frames.load(store, fields::kFrame, fields::kMeshHalo, id);
        s.weight = read(store, fields::kEdgeWeight, id);
        s.area = read(store, fields::kVertexArea, id);
      },
      [&](TileId, State& s) { assemble_tile(s, pull); },
      [&](TileId id, State& s) {
        write(store, fields::kCurlSystem.fit, id, s.fit);
        write(store, fields::kCurlSystem.rhs, id, s.rhs);
      });
}

double curl_scale(double log_v, const CurlOptions& options) {
  return exact::exp(options.power * std::clamp(log_v, -options.most_log, options.most_log));
}

class ScaleWriter::Tile final : public SolutionTask<RealBlock> {
 public:
  Tile(ScaleWriter& writer, TileId id) : writer_(writer), id_(id) {}
  void load() override { old_ = read(writer_.store_, fields::kFrame, id_); }
  void compute(std::span<const float> solution) override {
    frames_.assign(old_.begin(), old_.end());
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      frames_[i].scale = static_cast<float>(
          writer_.even_ * curl_scale(static_cast<double>(solution[i]), writer_.options_));
    }
  }
  void commit() override { writer_.board_.commit(writer_.store_, fields::kMeshHalo, id_, frames_); }

 private:
  ScaleWriter& writer_;
  TileId id_;
  ChunkView<VertexFrame> old_;
  std::vector<VertexFrame> frames_;
};

ScaleWriter::ScaleWriter(Store& store, const ScanMesh& mesh, const CurlOptions& options)
    : store_(store), options_(options), board_(fields::kFrame, mesh.layout) {}

void ScaleWriter::even_out(double mean_square) {
  even_ = mean_square > 0.0 ? 1.0 / std::sqrt(mean_square) : 1.0;
}

void ScaleWriter::even_out(double mean, double variance) {
  if (options_.mean) {
    even_ = *options_.mean / curl_scale(mean, options_);
    return;
  }
  // Scales are cut off, so their mean square is within their bounds, however far log v strays.
  const double scale = curl_scale(mean + options_.power * variance, options_);
  even_out(scale * scale);
}

std::unique_ptr<SolutionTask<RealBlock>> ScaleWriter::tile(TileId id) {
  return std::make_unique<Tile>(*this, id);
}

void ScaleWriter::finish() {
  board_.finish(store_);
}

void apply_scale(Store& store, const ScanMesh& mesh, const CurlOptions& options, TaskGraph& tasks) {
  struct ScaleState {
    ChunkView<float> solution;
    ChunkView<float> area;
    double area_sum = 0.0;
    double log_sum = 0.0;
    double scaled_sum = 0.0;
  };
  double area_sum = 0.0;
  double log_sum = 0.0;
  double scaled_sum = 0.0;
  run_pass<ScaleState>(
      tasks, "curl scale", mesh.layout.tile_count(),
      [&](TileId id, ScaleState& s) {
        s.solution = read(store, fields::kCurlSystem.solution, id);
        s.area = read(store, fields::kVertexArea, id);
      },
      [&](TileId, ScaleState& s) {
        for (std::size_t i = 0; i < s.area.size(); ++i) {
          const double v = curl_scale(static_cast<double>(s.solution[i]), options);
          s.area_sum += static_cast<double>(s.area[i]);
          s.log_sum += static_cast<double>(s.area[i]) * static_cast<double>(s.solution[i]);
          s.scaled_sum += static_cast<double>(s.area[i]) * v * v;
        }
      },
      [&](TileId, ScaleState& s) {
        area_sum += s.area_sum;
        log_sum += s.log_sum;
        scaled_sum += s.scaled_sum;
      });
  ScaleWriter writer(store, mesh, options);
  if (options.mean) {
    writer.even_out(area_sum > 0.0 ? log_sum / area_sum : 0.0, 0.0);
  } else {
    writer.even_out(area_sum > 0.0 ? scaled_sum / area_sum : 0.0);
  }
  SolveHooks<RealBlock> hooks;
  hooks.consume = [&](TileId id) { return writer.tile(id); };
  consume_solution(store, mesh.layout, fields::kCurlSystem.solution, hooks, tasks);
  writer.finish();
}

}  // namespace rattan
