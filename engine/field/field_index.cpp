// SPDX-License-Identifier: MIT
#include "engine/field/field_index.h"

#include <cmath>

#include "engine/core/exact_math.h"
#include "engine/field/tangent_frame.h"

namespace rattan {

namespace {

// e^{i N t}, t the turn of the field from a to b.
Complexd edge_turn(const VertexFrame& a, const VertexFrame& b, int n) {
  const Vec3d n_a = a.normal.cast<double>();
  const Vec3d n_b = b.normal.cast<double>();
  const Vec3d k_a = a.direction.cast<double>();
  const Vec3d k_b = b.direction.cast<double>();
  return symmetry_power(transport({k_a, n_a.cross(k_a)}, {k_b, n_b.cross(k_b)}), n);
}

// Turns below 53 degrees and a holonomy below 21 degrees cannot add up to half a turn.
constexpr double kSmallTurn = 0.602;
constexpr double kSmallHolonomy = 0.04;

double angle(Complexd z) {
  return exact::atan2(z.imag(), z.real());
}

}  // namespace

int triangle_index(const VertexFrame& a, const VertexFrame& b, const VertexFrame& c, int n) {
  const Complexd ab = edge_turn(a, b, n);
  const Complexd bc = edge_turn(b, c, n);
  const Complexd ca = edge_turn(c, a, n);
  // The holonomy of transport around the triangle is the signed area of the spherical triangle of
  // the normals, 2 atan2(volume, w).
  const Vec3d n_a = a.normal.cast<double>();
  const Vec3d n_b = b.normal.cast<double>();
  const Vec3d n_c = c.normal.cast<double>();
  const double volume = n_a.dot(n_b.cross(n_c));
  const double w = 1.0 + n_a.dot(n_b) + n_b.dot(n_c) + n_c.dot(n_a);
  if (ab.real() > kSmallTurn && bc.real() > kSmallTurn && ca.real() > kSmallTurn && w > 0.0 &&
      std::abs(volume) < kSmallHolonomy * w) {
    return 0;
  }
  const double turn = angle(ab) + angle(bc) + angle(ca) + n * 2.0 * exact::atan2(volume, w);
  return static_cast<int>(std::floor(turn / (2.0 * exact::kPi) + 0.5));
}

FieldIndexCount count_field_singularities(Store& store, const ScanMesh& mesh, Symmetry symmetry,
                                          TaskGraph& tasks) {
  struct State {
    ChunkView<LocalTriangle> triangles;
    HaloView<VertexFrame> frames;
    FieldIndexCount count;
  };
  const int n = static_cast<int>(symmetry);
  FieldIndexCount total;
  run_pass<State>(
      tasks, "field index", mesh.layout.tile_count(),
      [&](TileId id, State& s) {
        s.triangles = read(store, fields::kTriangle, id);
        s.frames.load(store, fields::kFrame, fields::kMeshHalo, id);
      },
      [&](TileId id, State& s) {
        const std::vector<VertexFrame> frames = s.frames.gather();
        const std::uint32_t owned = mesh.triangles[id.value].owned;
        for (const LocalTriangle& t : s.triangles.span().first(owned)) {
          const int index = triangle_index(frames[t[0]], frames[t[1]], frames[t[2]], n);
          s.count.positive += index > 0 ? 1 : 0;
          s.count.negative += index < 0 ? 1 : 0;
          s.count.sum += index;
        }
      },
      [&](TileId, State& s) {
        total.positive += s.count.positive;
        total.negative += s.count.negative;
        total.sum += s.count.sum;
      });
  return total;
}

}  // namespace rattan
